"""Sessions: what is done is not done again, and a kill leaves only finished models."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pyroshock.dataset.table import split_of
from pyroshock.parallel.executor import ExecutorConfig
from pyroshock.training.estimators.contact_time import ContactTimeProcess
from pyroshock.training.evaluation.floor import floor_metrics
from pyroshock.training.fitting import run_tasks
from pyroshock.training.fitting.fitting import FittingFailure, task_of
from pyroshock.training.fitting.run_tasks import TimeSettings
from pyroshock.training.fitting.session import Progress, train
from pyroshock.training.models import training_task
from pyroshock.training.models.catalogue import MODEL_SPECS, BuildOptions, entry_of, models_of
from pyroshock.training.registry.listing import chosen
from pyroshock.training.registry.locks import locked
from pyroshock.training.registry.registry import Registry
from support.records.pulse_tables import pulse_table
from support.stores.registries import context_in, fresh_registry, without_figures

MODELS = ["hann", "hertz", "linear"]
SPLITS = ["repetitions", "configurations"]
TESTS = Path(__file__).resolve().parent.parent

#: A session in a process of its own; KILL=n ends it as hard as can be, when n models are registered
#: and the next one is logged but not yet registered.
SCRIPT = """
import os, signal, sys
from pathlib import Path
sys.path.insert(0, sys.argv[1])
import mlflow
from pyroshock.training.fitting import session
from pyroshock.training.registry.model_storage import storage_for
from pyroshock.training.registry.registry import Registry
from support.stores.registries import context_in
left = [int(os.environ.get("KILL", "-1"))]
def counted(write):
    def counting(*args, **extra):
        if left[0] == 0:
            os.kill(os.getpid(), signal.SIGKILL)
        left[0] -= 1
        return write(*args, **extra)
    return counting
mlflow.register_model = counted(mlflow.register_model)
mlflow.MlflowClient.set_model_version_tag = counted(mlflow.MlflowClient.set_model_version_tag)
registry = Registry(storage_for(f"sqlite:///{sys.argv[2]}/lab.db", {}))
models, splits = ["hann", "hertz", "linear"], ["repetitions", "configurations"]
done = session.train(registry, context_in(registry), models, splits)
print(done.trained)
"""


@pytest.fixture
def registry(tmp_path, monkeypatch) -> Registry:
    without_figures(monkeypatch)
    return fresh_registry(tmp_path)


def start(folder: Path, **extra: str) -> subprocess.Popen[str]:
    command = [
        sys.executable,
        "-W",
        "error::ResourceWarning",
        "-c",
        SCRIPT,
        str(TESTS),
        str(folder),
    ]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    return subprocess.Popen(command, env={**os.environ, **extra}, **pipes)


def test_session_registers_every_model_once_on_every_split(registry, tmp_path):
    training_context = context_in(registry)
    session = train(registry, training_context, MODELS, SPLITS)
    wanted = [(model, split) for split in SPLITS for model in MODELS]
    assert [(version.name, version.split) for version in session.versions] == wanted
    assert (session.trained, session.failures) == (6, [])
    assert sorted(v.label for v in registry.versions()) == sorted(v.label for v in session.versions)
    again = train(registry, training_context, MODELS, SPLITS)
    assert (again.trained, again.versions) == (0, session.versions)
    assert {version.label for version in session.versions} == {"hann@1", "hertz@1", "linear@1"}
    floors = registry.floors(training_context.dataset.hash, 0)
    assert set(floors) == set(SPLITS)
    # Times scatter by 2 %, and a mean of two or three repetitions adds its own.
    assert (
        0.01 < floor_metrics(floors["repetitions"], "treatment")["contact_time_error"].mean < 0.04
    )
    # The same seed, the same model, whatever was trained before it.
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    other = fresh_registry(elsewhere)
    (alone,) = train(
        other, replace(training_context, work=other.place.work), ["linear"], ["configurations"]
    ).versions
    among = next(v for v in session.versions if (v.name, v.split) == ("linear", "configurations"))
    assert alone.sha256 == among.sha256


def test_version_holds_the_figures_of_all_its_splits_and_serves_the_model_of_the_first(registry):
    training_context = context_in(registry)
    train(registry, training_context, ["linear"], ["repetitions"])
    train(
        registry, training_context, ["linear"], ["configurations"]
    )  # later: another split of the same training
    records = {record.split: record for record in registry.versions()}
    assert {record.label for record in records.values()} == {"linear@1"} and records.keys() == set(
        SPLITS
    )
    assert [split for split, record in records.items() if record.is_served] == ["repetitions"]
    sides = {split: registry.held_out(record) for split, record in records.items()}
    assert set(sides["repetitions"].keys) != set(sides["configurations"].keys)
    for split, record in records.items():
        registered = registry.load(record)
        rows = np.isin(training_context.table.key, sides[split].keys)
        prediction = registered.predict(training_context.table.take(rows).inputs).prediction
        held_out_force = sides[split].prediction.force_n[np.argsort(sides[split].keys)]
        keys = training_context.table.take(rows).key
        np.testing.assert_array_equal(prediction.force_n[np.argsort(keys)], held_out_force)
    crowned = records["repetitions"]
    registry.set_champion(crowned)
    assert registry.champion("hammer").run_id == crowned.run_id
    chosen_labels = [chosen(registry.versions(), text, split).split for text, split in (
        ("linear@1", None), ("linear@1", "configurations"), ("linear@champion", None), ("linear",
        "configurations"),
    )]  # fmt: skip
    assert chosen_labels == ["repetitions", "configurations", "repetitions", "configurations"]
    again = train(registry, training_context, ["linear"], SPLITS, retrain=True)
    assert [record.label for record in again.versions] == ["linear@2", "linear@2"]
    other = train(registry, replace(training_context, seed=1), ["linear"], ["configurations"])
    assert [record.label for record in other.versions] == ["linear@3"]


def test_retrain_adds_versions_of_the_same_numbers_and_open_runs_are_closed(registry):
    training_context = context_in(registry)
    (first,) = train(registry, training_context, ["linear"], SPLITS[:1]).versions
    with (
        registry.connection.client() as client
    ):  # as a kill leaves it between registering the model and closing
        client.update_run(first.run_id, "RUNNING")
    assert train(registry, training_context, ["linear"], SPLITS[:1]).trained == 0
    with registry.connection.client() as client:
        assert client.get_run(first.run_id).info.status == "FINISHED"
    (again,) = train(registry, training_context, ["linear"], SPLITS[:1], retrain=True).versions
    assert (first.version, again.version) == (1, 2)
    assert (first.metrics, first.sha256) == (again.metrics, again.sha256)


def test_what_decides_a_training_makes_it_another(registry, monkeypatch):
    training_context = context_in(registry)
    keys = {
        task_of("linear", "repetitions", other_context).key
        for other_context in (training_context, replace(training_context, seed=1))
    }
    keys.add(task_of("linear", "configurations", training_context).key)
    keys.add(task_of("linear", "repetitions", context_in(registry, name="autumn")).key)
    keys.add(replace(task_of("linear", "repetitions", training_context), settings={}).key)
    monkeypatch.setattr(training_task, "TRAINING_VERSION", training_task.TRAINING_VERSION + 1)
    keys.add(task_of("linear", "repetitions", training_context).key)
    assert len(keys) == 6
    full = replace(training_context, budget="full")
    assert (
        task_of("nn-ga", "repetitions", training_context).key
        != task_of("nn-ga", "repetitions", full).key
    )
    assert (
        task_of("hybrid", "repetitions", training_context).key
        == task_of("hybrid", "repetitions", full).key
    )


def test_model_that_cannot_learn_stops_no_other(registry):
    training_context = context_in(registry)
    table = replace(
        training_context.table, impactor_mass_kg=np.full(len(training_context.table), np.nan)
    )
    told: list[str] = []
    session = train(
        registry,
        replace(training_context, table=table),
        ["hann", "linear"],
        SPLITS[:1],
        progress=Progress(tell=told.append),
    )
    assert [version.name for version in session.versions] == ["linear"]
    assert [failure.model for failure in session.failures] == ["hann"]
    assert "mass" in session.failures[0].reason
    assert told[0].startswith("hann not trained on repetitions")


def test_progress_is_the_share_of_the_work_and_not_of_the_models(registry):
    """Of these models the search of the contact time and the genetic search take nearly all the
    time."""
    steps: list[tuple[int, int, str]] = []
    models = ["hann", "linear", "nn-narrow", "nn-ga"]
    small = replace(context_in(registry), budget="small")
    train(registry, small, models, SPLITS[:1], progress=Progress(lambda *step: steps.append(step)))
    shares = [done / total for done, total, _ in steps]
    assert shares == sorted(shares)
    assert (shares[0], shares[-1], steps[-1][2]) == (0.0, 1.0, "4 of 4 models")
    without_search = [
        share
        for share, (_, _, words) in zip(shares, steps, strict=True)
        if words.startswith("2 of 4 models; nn-narrow")
    ]
    assert without_search[0] < 0.1
    assert 0.35 < without_search[-1] < 0.55
    generations = [words for _, _, words in steps if words.startswith("3 of 4 models; nn-ga")]
    assert len(generations) == 1 + 4


def test_kill_leaves_only_finished_models_and_repeat_completes(registry, tmp_path):
    """Killed at the worst moment: everything of the third model is logged, and it is not registered
    yet."""
    process = start(tmp_path, KILL="2")
    process.communicate(timeout=100)
    assert process.returncode == -signal.SIGKILL
    left = registry.versions()
    assert sorted(version.name for version in left) == ["hann", "hertz"]
    assert all(len(registry.held_out(version).keys) and registry.load(version) for version in left)

    session = train(registry, context_in(registry), MODELS, SPLITS)
    assert session.trained == 4
    assert len(registry.versions()) == 6
    assert {version.run_id for version in left} < {version.run_id for version in session.versions}
    with registry.connection.client() as client:
        runs = client.search_runs([registry.connection.experiment])
    assert {run.info.status for run in runs} == {"FINISHED"}
    assert len(runs) == 7  # six trainings and the session over them: the half one is gone


@pytest.mark.slow
def test_two_at_once_train_each_model_once(registry, tmp_path):
    both = [start(tmp_path) for _ in range(2)]
    ends = [process.communicate(timeout=100) for process in both]
    assert [process.returncode for process in both] == [0, 0], ends
    assert sorted(int(out) for out, _ in ends) == [0, 6]
    assert len(registry.versions()) == 6


def test_split_by_material(registry):
    """Its text holds a sign that MLflow does not take everywhere."""
    training_context = context_in(registry)
    (version,) = train(registry, training_context, ["hann"], ["material=delrin"]).versions
    assert registry.versions() == [version]
    assert set(registry.floors(training_context.dataset.hash, 0)) == {"material=delrin"}
    delrin = training_context.table.tip_material == "delrin"
    assert set(registry.held_out(version).keys) == set(training_context.table.key[delrin])


def test_interruption_before_the_summary_is_made_good(registry, monkeypatch):
    training_context = context_in(registry)
    with monkeypatch.context() as broken, pytest.raises(KeyboardInterrupt):
        broken.setattr(Registry, "close_session", _interrupted)
        train(registry, training_context, ["hann"], SPLITS)
    assert registry.floors(training_context.dataset.hash, 0) == {}
    assert train(registry, training_context, ["hann"], SPLITS).trained == 0
    assert set(registry.floors(training_context.dataset.hash, 0)) == set(SPLITS)


def _interrupted(*_: object) -> None:
    raise KeyboardInterrupt


def test_lock_of_a_killed_process_is_free(tmp_path):
    script = (
        "import os, sys; from pathlib import Path; from "
        "pyroshock.training.registry.locks import locked\n"
    )
    script += "with locked(Path(sys.argv[1])): os.kill(os.getpid(), 9)"
    subprocess.run(
        [sys.executable, "-c", script, str(tmp_path / "a.lock")], timeout=60, check=False
    )
    with locked(tmp_path / "a.lock", lambda: pytest.fail("it waits for a dead process")):
        pass


def test_contact_time_is_searched_once_for_all(registry, monkeypatch):
    """And kept for the next training; a model that does not share it has no part in it."""
    searched, given = [], {}

    def search(pulses, _):
        searched.append(len(pulses))
        return TimeSettings({"kernel": "rbf"}, 1.0)

    def attempt(task, _, tuned=None, *others):
        given[task.model] = tuned
        return FittingFailure(task.model, task.split, "not tried")

    monkeypatch.setattr(run_tasks, "_searched", search)
    monkeypatch.setattr(run_tasks, "try_fit", attempt)
    models = ["hann", "nn-narrow", "gp", "nn-ga"]
    for _ in range(2):
        train(registry, context_in(registry), models, SPLITS[:1])
    assert searched == [120]
    assert given == {"hann": None} | {model: {"kernel": "rbf"} for model in models[1:]}


def test_history_of_the_shared_search_is_registered_with_every_model_that_shares_it(
    registry, monkeypatch
):
    """It is kept with what was found: a model that is trained later has it too."""
    training_context = context_in(registry)
    pulses = training_context.table.take(split_of(training_context.table, "repetitions", 0).train)
    process = ContactTimeProcess(iterations=2, search_rows=40)
    process.fit(
        pulses.x, pulses.contact_time_s[:, None], pulses.configuration, np.random.default_rng(1)
    )
    searched = TimeSettings(
        process.tuned_, 1.5, {"search_error": [0.5, 0.25]}, process.fit_report().searches
    )
    run_tasks.write_time_settings(searched, "repetitions", training_context)
    shared, alone = train(
        registry, context_in(registry), ["nn-narrow", "linear"], SPLITS[:1]
    ).versions
    assert registry.fit_histories(shared)["time.search_error"] == [(0, 0.5), (1, 0.25)]
    assert registry.fit_settings(shared)["time.search_seconds"] == 1.5
    assert registry.searches(shared) == {"time": process.search_}
    assert registry.searches(alone) == {}
    assert not any(name.startswith("time.search") for name in registry.fit_histories(alone))


def test_file_of_a_search_by_older_software_is_read(registry):
    training_context = context_in(registry)
    run_tasks.write_time_settings(
        TimeSettings({"kernel": "rbf"}, 2.0, {"search_error": [1.0]}),
        "repetitions",
        training_context,
    )
    (file,) = training_context.work.glob("contact-time-*.json")
    file.write_text('{"tuned": {"kernel": "matern"}, "seconds": 3.0}')
    assert run_tasks.read_time_settings("repetitions", training_context) == TimeSettings(
        {"kernel": "matern"}, 3.0
    )


def test_contact_time_that_cannot_be_searched_fails_the_models_that_share_it(registry, monkeypatch):
    def search(*_):
        raise ValueError("no two times differ")

    monkeypatch.setattr(run_tasks, "_searched", search)
    session = train(registry, context_in(registry), ["nn-narrow", "linear", "nn-ga"], SPLITS[:1])
    assert [version.name for version in session.versions] == ["linear"]
    assert {(each.model, each.reason) for each in session.failures} == {
        ("nn-narrow", "no two times differ"),
        ("nn-ga", "no two times differ"),
    }


def test_names_of_models_are_those_of_the_contract():
    wanted = (
        "tree ensemble svr kernel-ridge linear pls gp coregional-gp nn-narrow "
        "nn-medium nn-wide nn-bilayer"
    )
    wanted += " nn-trilayer nn-ga single-pass hybrid hunter reed hann hertz hunt-crossley"
    assert set(wanted.split()) <= set(MODEL_SPECS)
    assert models_of("all") == list(MODEL_SPECS)
    assert models_of("gp, hybrid,gp") == ["gp", "hybrid"]


@pytest.mark.parametrize(
    ("text", "said"), [("magic", "no model 'magic'; there are: hunter"), (",", "no model is named")]
)
def test_unknown_models_are_refused(text, said):
    with pytest.raises((LookupError, ValueError), match=said):
        models_of(text)


@pytest.mark.parametrize("name", MODEL_SPECS)
def test_every_model_is_made_and_described(name):
    """Its settings are JSON, and make the same model again."""
    from pyroshock.training.models.serialization import build, describe

    model = entry_of(name).make(BuildOptions())
    assert build(describe(model)).settings() == model.settings()


@pytest.mark.slow
def test_jobs_at_once_register_the_same(tmp_path):
    alone, together = tmp_path / "alone", tmp_path / "together"
    table = pulse_table(np.random.default_rng(1), repetitions=3)
    found = []
    for folder, jobs in ((alone, 1), (together, 2)):
        folder.mkdir()
        registry = fresh_registry(folder)
        session = train(
            registry,
            context_in(registry, table),
            MODELS,
            SPLITS,
            executor=ExecutorConfig(jobs=jobs),
        )
        found.append([(v.name, v.split, v.metrics, v.sha256) for v in session.versions])
    assert found[0] == found[1]
