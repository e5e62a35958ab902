"""What is registered reads back as it was, one model is in use, and models live where the user
says."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import sqlite3
import threading
import time
import uuid
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas
import pytest
from pyroshock.training.estimators.base import FitReport
from pyroshock.training.fitting.fitting import TrainingContext, fit_task, task_of
from pyroshock.training.models.serialization import unpack
from pyroshock.training.registry.connection import RegistryError, user_environment
from pyroshock.training.registry.file_hashes import AlteredFilesError
from pyroshock.training.registry.loading import ServedModel
from pyroshock.training.registry.model_storage import VARIABLE, storage_for
from pyroshock.training.registry.promotion import promote
from pyroshock.training.registry.records import DatasetName, Trained, Version
from pyroshock.training.registry.registry import Registry
from pyroshock.training.tuning.trials import SettingsSearch, Trial
from sqlalchemy import make_url
from support.records.pulse_tables import PREDICTORS, frame_of_inputs, inputs_at, pulse_table
from support.stores.databases import _execute
from support.stores.registries import (
    context_in,
    fresh_registry,
    without_figures,
    without_judging_the_first,
)


@pytest.fixture
def registry(tmp_path, monkeypatch) -> Registry:
    without_figures(monkeypatch)
    return fresh_registry(tmp_path)


@pytest.fixture
def first_unjudged(monkeypatch) -> None:
    """A model is put in use by force, as another's champion to beat."""
    without_judging_the_first(monkeypatch)


def trained(context: TrainingContext, model: str, split: str = "repetitions") -> Trained:
    return fit_task(task_of(model, split, context), context)


@dataclass(frozen=True)
class RecordedVersions:
    """One registry with a version of several models, which tests read and none changes."""

    registry: Registry
    context: TrainingContext
    trained: dict[str, Trained]
    versions: dict[str, Version]


@pytest.fixture(scope="module")
def recorded(tmp_path_factory) -> Iterator[RecordedVersions]:
    with pytest.MonkeyPatch.context() as patch:
        without_figures(patch)
        registry = fresh_registry(tmp_path_factory.mktemp("recorded"))
        context = context_in(registry)
        made = {
            model: trained(context, model) for model in ("linear", "tree", "kernel-ridge", "hann")
        }
        yield RecordedVersions(
            registry, context, made, {model: registry.record(made[model]) for model in made}
        )


def test_version_reads_back_as_recorded(recorded):
    assert {version.name: version for version in recorded.registry.versions()} == recorded.versions
    version = recorded.versions["linear"]
    assert version.metrics == recorded.trained["linear"].metrics
    assert (version.name, version.version, version.split, version.seed) == (
        "linear",
        1,
        "repetitions",
        0,
    )
    assert version.dataset == recorded.context.dataset


def test_loaded_model_predicts_the_same_bits_and_names_what_lies_outside(recorded):
    model, inputs = (
        recorded.registry.load(recorded.versions["linear"]),
        recorded.context.table.inputs,
    )
    prediction = model.predict(inputs).prediction
    expected = unpack(*recorded.trained["linear"].packed).predict(inputs)
    np.testing.assert_array_equal(prediction.force_n, expected.force_n)
    np.testing.assert_array_equal(prediction.contact_time_spread_s, expected.contact_time_spread_s)
    table = recorded.context.table.take(np.arange(2))
    outside = model.predict(inputs_at(table, impact_velocity=9.0)).outside
    assert [predictors[0].predictor for predictors in outside] == ["impact_velocity"] * 2
    assert model.predict(table.inputs).outside == ((), ())
    fewer = replace(inputs, predictors=inputs.predictors[1:], x=inputs.x[:, 1:])
    with pytest.raises(ValueError, match=r"hann@1 is asked with .* it knows"):
        recorded.registry.load(recorded.versions["hann"]).predict(fewer)


def test_held_out_predictions_are_those_of_the_metrics(recorded):
    made = recorded.trained["hann"]
    held_out = recorded.registry.held_out(recorded.versions["hann"])
    np.testing.assert_array_equal(held_out.keys, made.held_out.keys)
    np.testing.assert_array_equal(held_out.prediction.force_n, made.held_out.prediction.force_n)
    assert held_out.prediction.force_spread_n is None
    assert set(held_out.keys) | set(held_out.trained_on) == set(recorded.context.table.key)
    assert not set(held_out.keys) & set(held_out.trained_on)


def test_mlflow_itself_predicts_from_a_table_with_pickle_forbidden(registry, monkeypatch):
    monkeypatch.setenv("MLFLOW_ALLOW_PICKLE_DESERIALIZATION", "false")
    context = context_in(registry)
    made = trained(context, "linear")
    registry.set_champion(registry.record(made))
    table = context.table.take(np.arange(0, len(context.table), 40))
    with registry.connection.client():
        import mlflow

        served = mlflow.pyfunc.load_model("models:/linear@champion")
        by_number = mlflow.pyfunc.load_model("models:/linear/1")
        answer = served.predict(frame_of_inputs(table.inputs))
        whole = {
            "tip_youngs_modulus_pa": np.int64
        }  # as read from a CSV file without decimal points
        by_position = by_number.predict(frame_of_inputs(table.inputs, levels=False).astype(whole))
        units = served.metadata.metadata["units"]
        columns = served.metadata.signature.inputs.input_names()
    expected = unpack(*made.packed).predict(table.inputs)
    np.testing.assert_array_equal(answer.filter(regex=r"^force_n_\d\d$"), expected.force_n)
    np.testing.assert_array_equal(answer["contact_time_spread_s"], expected.contact_time_spread_s)
    assert by_position.equals(answer)
    assert units["inputs"]["impact_velocity_m_s"] == "m/s"
    assert units["outputs"]["force_n_20"] == "N"
    assert set(columns) == units["inputs"].keys()


def test_table_for_a_model_is_checked(recorded):
    context = recorded.context
    served = ServedModel(unpack(*recorded.trained["hann"].packed), context.table.predictors)
    table = frame_of_inputs(context.table.take(np.arange(2)).inputs)
    assert list(served.predict(table.set_index(pandas.Index(["a", "b"]))).index) == ["a", "b"]
    with pytest.raises(
        ValueError, match="lacks the columns tip_radius_m; the model needs tip_radius_m, tip_youngs"
    ):
        served.predict(table.drop(columns="tip_radius_m"))
    with pytest.raises(
        ValueError, match="insulator is 'felt'; it may be none, polymeric, or 0 to 1 in this order"
    ):
        served.predict(table.assign(insulator=["none", "felt"]))
    with pytest.raises(ValueError, match="insulator is 2; it may be"):
        served.predict(table.assign(insulator=[1, 2]))
    with pytest.raises(
        ValueError, match="column impact_velocity_m_s holds something that is no number"
    ):
        served.predict(table.assign(impact_velocity_m_s=["fast", "slow"]))
    with pytest.raises(ValueError, match=r"a table .* is expected, not dict"):
        served.predict({"x": context.table.x})


REPORT = FitReport(
    {
        "force.kernel": "matern",
        "force.noise": 0.013,
        "force.rank": 3,
        "force.ard": True,
        "force.layers": "10-10",
    },
    {"force.lengthscale": [0.5 + 0.1 * number for number in range(len(PREDICTORS))]},
    {"force.loss": [1 / (1 + step) for step in range(1000)], "time.search_error": [0.3, 0.2, 0.25]},
    {
        "time": SettingsSearch(
            "grid search",
            "error",
            (Trial({"rank": 3, "kernel": "rbf", "ard": True}, 0.3, 1.5), Trial({"rank": 4}, 0.2)),
        )
    },
)


def test_trials_of_searches_read_back_fast_and_are_none_of_an_older_version(registry):
    made = replace(trained(context_in(registry), "hann"), fit_report=REPORT)
    version = registry.record(made)
    begun = time.perf_counter()
    searches = registry.searches(version)
    assert time.perf_counter() - begun < 0.1
    assert searches == REPORT.searches
    assert [trial.duration_s for trial in searches["time"].trials] == [1.5, None]
    assert searches["time"].settings == ("rank", "kernel", "ard")
    assert searches["time"].best.settings == {"rank": 4}
    older = registry.record(replace(made, fit_report=FitReport({"force.rank": 3})))
    assert registry.searches(older) == {}


def test_what_was_searched_and_learned_reads_back(registry):
    made = replace(trained(context_in(registry), "hann"), fit_report=REPORT)
    version = registry.record(made)
    settings, histories = registry.fit_settings(version), registry.fit_histories(version)
    assert settings == REPORT.parameters([predictor.name for predictor in PREDICTORS])
    assert settings["force.lengthscale.tip_density"] == 0.8
    assert histories["time.search_error"] == [(0, 0.3), (1, 0.2), (2, 0.25)]
    loss = histories["force.loss"]
    assert (len(loss), loss[0], loss[-1]) == (200, (0, 1.0), (999, 0.001))
    assert all(value == 1 / (1 + step) for step, value in loss)
    assert histories.keys() == {"force.loss", "time.search_error"}


@pytest.mark.parametrize("model", ["linear", "tree", "kernel-ridge"])
def test_version_has_the_settings_and_histories_that_its_model_reports(recorded, model):
    registry, version = recorded.registry, recorded.versions[model]
    report = recorded.trained[model].fit_report
    assert registry.fit_settings(version) == report.parameters(
        [predictor.name for predictor in PREDICTORS]
    )
    histories = registry.fit_histories(version)
    assert registry.searches(version) == report.searches
    assert histories.keys() == report.histories.keys()
    assert {name: history[-1][1] for name, history in histories.items()} == {
        name: values[-1] for name, values in report.histories.items()
    }


def test_runs_are_sorted_by_a_setting_that_is_a_number(registry):
    made = trained(context_in(registry), "hann")
    for noise in (0.2, 0.05, 0.1):
        registry.record(replace(made, fit_report=FitReport({"force.noise": noise})))
    with registry.connection.client() as client:
        runs = client.search_runs(
            [registry.connection.experiment],
            "metrics.`fit.force.noise` < 0.15",
            order_by=["metrics.`fit.force.noise`"],
        )
    assert [run.data.params["fit.force.noise"] for run in runs] == ["0.05", "0.1"]
    version = registry.record(replace(made, fit_report=FitReport()))
    assert (registry.fit_settings(version), registry.fit_histories(version)) == ({}, {})


def test_metrics_and_datasets_belong_to_the_run_with_their_hash_and_columns(recorded):
    made, version = recorded.trained["hann"], recorded.versions["hann"]
    with recorded.registry.connection.client() as client:
        import mlflow

        run = client.get_run(version.run_id)
        source = mlflow.data.get_source(run.inputs.dataset_inputs[0].dataset).to_dict()
        model = client.get_logged_model(run.outputs.model_outputs[0].model_id)
    by_side = {used.tags[0].value: used.dataset for used in run.inputs.dataset_inputs}
    assert by_side.keys() == {"training", "held-out"}
    for side, keys in (("training", made.held_out.trained_on), ("held-out", made.held_out.keys)):
        digest = hashlib.sha256("\n".join(sorted(keys)).encode()).hexdigest()
        assert by_side[side].digest == digest[:36]
        assert json.loads(by_side[side].profile)["pulses"] == len(keys)
        columns = [column["name"] for column in json.loads(by_side[side].schema)["mlflow_colspec"]]
        assert columns[:2] == ["tip_radius_m", "tip_youngs_modulus_pa"]
    assert source["tags"]["snapshot"] == made.dataset.hash
    of_it = {metric.key: metric for metric in model.metrics}
    assert of_it["force_nrmse"].value == made.metrics["force_nrmse"].mean
    assert of_it["force_nrmse"].dataset_name == "spring, repetitions, held-out"
    assert run.data.params["dataset_hash"] == made.dataset.hash
    assert run.info.status == "FINISHED"


def test_tags_name_the_libraries_that_a_model_uses(recorded):
    with recorded.registry.connection.client() as client:
        tags = {
            name: client.get_run(recorded.versions[name].run_id).data.tags
            for name in ("hann", "tree")
        }
    libraries = ("numpy", "scipy", "mlflow", "scikit-learn", "torch", "gpytorch", "optuna", "skops")
    named = {
        name: {library for library in libraries if f"pyroshock.{library}" in tags[name]}
        for name in tags
    }
    always = {"numpy", "scipy", "mlflow"}
    assert named == {"hann": always, "tree": always | {"scikit-learn", "skops"}}


def test_process_settings_are_left_as_they_were(registry, monkeypatch, tmp_path):
    monkeypatch.setenv("MLFLOW_TRACKING_URI", "sqlite:////elsewhere.db")
    registry.record(trained(context_in(registry), "hann"))
    assert os.environ["MLFLOW_TRACKING_URI"] == "sqlite:////elsewhere.db"
    monkeypatch.setenv(VARIABLE, "sqlite:////elsewhere.db")
    with fresh_registry(tmp_path, "other").connection.client() as client:
        assert os.environ[VARIABLE] == "sqlite:////elsewhere.db"
        assert client.tracking_uri == f"sqlite:///{tmp_path / 'other-models.db'}"
    assert os.environ[VARIABLE] == "sqlite:////elsewhere.db"


def test_threads_take_turns_with_the_address_of_a_registry(registry, tmp_path):
    """It is the process's: one that ended would leave the other at MLflow's default place."""
    import mlflow

    other, addresses = fresh_registry(tmp_path, "other"), []

    def ask() -> None:
        with other.connection.client():
            addresses.append(mlflow.get_tracking_uri())

    thread = threading.Thread(target=ask)
    with registry.connection.client():
        thread.start()
        thread.join(0.3)
        assert addresses == [] and mlflow.get_tracking_uri() == registry.place.tracking_uri
    thread.join(60)
    assert addresses == [other.place.tracking_uri]


def test_reading_waits_for_no_thread_that_writes(registry, tmp_path):
    other = fresh_registry(tmp_path, "other")
    with registry.connection.client(), ThreadPoolExecutor(1) as pool:
        assert pool.submit(other.versions).result(30) == []


def test_moved_folder_is_found_and_changed_or_vanished_files_are_told(registry, tmp_path):
    version = registry.record(trained(context_in(registry), "hann"))
    there = tmp_path / "moved"
    there.mkdir()
    shutil.move(tmp_path / "lab-models", there / "lab-models")
    shutil.move(tmp_path / "lab-models.db", there / "lab-models.db")
    moved = Registry(storage_for(f"sqlite:///{there / 'lab.db'}", {}))
    assert moved.load(version).model.kind == "analytic"
    assert len(moved.held_out(version).keys)
    (file,) = (there / "lab-models").glob("models/*/artifacts/data/*/model.json")
    file.write_text(file.read_text().replace('"hann"', '"reed"'))
    with pytest.raises(
        AlteredFilesError, match=r"hann@1: .*model\.json is not the file that was registered"
    ):
        moved.load(version)
    shutil.rmtree(there / "lab-models" / "models")
    with pytest.raises(RegistryError, match="the files of hann@1 are gone"):
        moved.load(version)


def test_first_model_that_learned_nothing_of_other_configurations_is_refused(registry):
    """Repetitions are predicted to some per cent, other configurations by chance: the defect that
    the gate is for."""
    context = context_in(registry, _without_law(context_in(registry).table))
    made = trained(context, "linear")
    registry.record(made)
    decision = promote(registry, "linear", 1, lambda _: context.table)
    assert not decision.promoted
    assert decision.reason.startswith(
        "without a model the contact law updated by the measured shots predicts unseen "
    )
    assert "configurations better than linear@1: mean CRPS" in decision.reason
    assert registry.champion("hammer") is None


def _two_repetitions():
    """Fewer pulses: the law learns from them in less time."""
    return pulse_table(np.random.default_rng(1), repetitions=2)


def _without_law(table):
    """Twelve configurations with forces far from each other, whatever the predictors say."""
    few = table.take(np.isin(table.configuration, np.unique(table.configuration)[::5]))
    factor = np.exp(0.2 * np.random.default_rng(3).normal(size=len(np.unique(few.configuration))))
    return _scaled(few, factor[np.unique(few.configuration, return_inverse=True)[1]])


def _scaled(table, factor):
    """Forces of each pulse times its factor (n,), contact times by it: impulses stay what they
    are."""
    times = {
        name: getattr(table, name) / factor for name in ("contact_time_s", "compression_time_s")
    }
    return replace(
        table,
        force_n=table.force_n * factor[:, None],
        peak_force_n=table.peak_force_n * factor,
        **times,
    )


def test_worse_model_is_refused_and_dethrones_by_force_with_a_reason(registry, first_unjudged):
    context = context_in(registry, _two_repetitions())
    registry.record(trained(context, "hann"))
    registry.record(trained(context, "linear"))
    promote(registry, "hann", 1, lambda _: context.table, forced=True, reason="a start")
    decision = promote(registry, "linear", 1, lambda _: context.table)
    assert not decision.promoted
    assert decision.reason.startswith("hann@1 predicts unseen configurations better than linear@1")
    assert decision.figures["crps.candidate"] > decision.figures["crps.reference"]
    # As further information: of configurations that it knows, the refused one predicts the pulses
    # better.
    assert decision.figures["cost.candidate"] < decision.figures["cost.champion"]
    assert (decision.pulses, decision.judged_against) == (120, "hann@1")
    assert "crps.prior" not in decision.figures
    assert registry.champion("hammer").name == "hann"
    assert [decision.promoted for decision in registry.decisions()] == [False, True]
    with pytest.raises(ValueError, match="--reason"):
        promote(registry, "linear", 1, lambda _: context.table, forced=True)
    decision = promote(
        registry, "linear", 1, lambda _: context.table, forced=True, reason="to show it"
    )
    assert decision.promoted
    assert decision.reason.startswith("to show it; promoted by force although hann@1 predicts")
    assert [version.label for version in registry.versions() if version.champion_of] == ["linear@1"]
    with registry.connection.client() as client:
        assert {m.name: m.aliases for m in client.search_registered_models()} == {
            "linear": {"champion": 1, "champion-hammer": 1},
            "hann": {},
        }


def test_single_configuration_cannot_be_judged(registry):
    table = context_in(registry).table
    context = context_in(registry, table.take(table.configuration == table.configuration[0]))
    registry.record(trained(context, "hann"))
    decision = promote(registry, "hann", 1, lambda _: context.table)
    assert (decision.promoted, decision.verdict) == (False, "not enough to judge")
    assert (
        "1 configurations are not enough to judge a model: 10 at least are needed"
        in decision.reason
    )
    assert registry.champion("hammer") is None
    decision = promote(
        registry, "hann", 1, lambda _: context.table, forced=True, reason="the only one"
    )
    assert decision.promoted and decision.judged_on == "nothing"
    assert decision.reason.startswith("the only one; promoted by force although 1 configurations")


def test_each_predictor_set_has_its_champion(registry, first_unjudged):
    context = context_in(registry)
    registry.record(trained(context, "linear"))
    gun = replace(context, dataset=DatasetName("shots", "f" * 64, "gun"))
    registry.record(trained(gun, "linear"))
    for version in (1, 2):
        promote(
            registry,
            "linear",
            version,
            lambda _: context.table,
            forced=True,
            reason="one for each set",
        )
    assert {v.version: v.champion_of for v in registry.versions()} == {1: "hammer", 2: "gun"}


def test_version_states_its_kinds_and_how_much_it_learned_from(registry, first_unjudged):
    context = context_in(registry)
    stated = replace(context.dataset, bench_kind="hammer", velocity_kind="integrated to the peak")
    version = registry.record(trained(replace(context, dataset=stated), "hann"))
    assert registry.versions()[0].dataset == version.dataset == stated
    assert registry.versions()[0].promoted_at == ""
    promote(registry, "hann", 1, lambda _: context.table, forced=True, reason="the only one")
    assert registry.versions()[0].promoted_at
    assert registry.load(version).shots == len(registry.held_out(version).trained_on) > 0


def test_other_kinds_of_velocity_are_not_judged_on_the_same_pulses(registry, first_unjudged):
    context = context_in(registry)
    for model, kind in (("tree", "before contact"), ("hann", "integrated to the peak")):
        registry.record(
            trained(replace(context, dataset=replace(context.dataset, velocity_kind=kind)), model)
        )
    promote(registry, "tree", 1, lambda _: context.table, forced=True, reason="the only one")
    with pytest.raises(
        ValueError,
        match="hann@1 velocities integrated to the peak and tree@1 velocities before contact",
    ):
        promote(registry, "hann", 1, lambda _: context.table, other=("autumn", context.table))


def test_champion_half_dethroned_is_no_second_one(registry):
    """A kill between setting the new alias and taking the old one away."""
    context = context_in(registry)
    for model in ("hann", "hertz"):
        registry.record(trained(context, model))
        registry.set_champion(registry.versions()[0])
    with registry.connection.client() as client:
        client.set_registered_model_alias("hann", "champion-hammer", "1")
    assert [version.label for version in registry.versions() if version.champion_of] == ["hertz@1"]


def test_other_campaign_judges_models_without_its_configurations(registry, first_unjudged):
    context = context_in(registry)
    registry.record(trained(context, "hann"))
    registry.record(trained(context, "linear"))
    promote(registry, "hann", 1, lambda _: context.table, forced=True, reason="a start")
    other = pulse_table(np.random.default_rng(2), repetitions=1, campaign="autumn")
    decision = promote(registry, "linear", 1, lambda _: context.table, other=("autumn", other))
    judged = (False, "unseen configurations of autumn", 60)
    assert (decision.promoted, decision.judged_on, decision.pulses) == judged


@pytest.mark.parametrize("uri", ["./mlruns", "file:///tmp/mlruns"])
def test_folder_as_tracking_uri_is_refused(uri):
    with pytest.raises(ValueError, match="no models in plain folders"):
        storage_for("sqlite:///lab.db", {"MLFLOW_TRACKING_URI": uri})


def test_places_of_models_are_told_by_the_environment(tmp_path):
    place = storage_for("sqlite:///lab.db", {"MLFLOW_TRACKING_URI": f"sqlite:///{tmp_path}/m.db"})
    assert (place.tracking_uri, place.folder) == (f"sqlite:///{tmp_path}/m.db", tmp_path / "m")
    beside = storage_for(f"sqlite:///{tmp_path}/lab.db", {})
    assert (beside.tracking_uri, beside.folder) == (
        f"sqlite:///{tmp_path}/lab-models.db",
        tmp_path / "lab-models",
    )
    server = storage_for("postgresql+psycopg://lab@host/store", {})
    assert server.database == Path.cwd() / "pyroshock-models.db"
    url = "postgresql+psycopg://lab@host/store"
    with pytest.raises(ValueError, match="one of their own"):
        storage_for(url, {"MLFLOW_TRACKING_URI": url})
    registry = Registry(storage_for(f"sqlite:///{tmp_path / 'lab.db'}", {}))
    assert (registry.versions(), registry.decisions(), registry.floors("", 0)) == ([], [], {})
    assert list(tmp_path.iterdir()) == []


def test_newer_tables_are_one_error(registry):
    with closing(sqlite3.connect(registry.place.database)) as connection, connection:
        connection.execute("UPDATE alembic_version SET version_num = 'from-the-future'")
    with pytest.raises(RegistryError, match="model registry sqlite"):
        registry.versions()


def test_error_is_what_failed(registry):
    """A database that was deleted beneath its connections told of SQLAlchemy's autoflush alone."""
    from mlflow.exceptions import MlflowException

    told = (
        "(raised as a result of Query-invoked autoflush; "
        "...)\n(sqlite3.OperationalError) readonly\n[SQL: ...]"
    )
    told_of_it = pytest.raises(
        RegistryError, match=r"lab-models.db: \(sqlite3.OperationalError\) readonly$"
    )
    with told_of_it, registry.connection.client():
        raise MlflowException(told)


def test_registry_on_postgresql(postgres_url, tmp_path, monkeypatch):
    without_figures(monkeypatch)
    monkeypatch.chdir(tmp_path)
    server, name = make_url(postgres_url), f"models_{uuid.uuid4().hex}"
    _execute(server, f'CREATE DATABASE "{name}"')
    try:
        uri = server.set(database=name).render_as_string(hide_password=False)
        registry = Registry(storage_for("sqlite:///lab.db", {"MLFLOW_TRACKING_URI": uri}))
        version = registry.record(trained(context_in(registry), "hann"))
        assert registry.versions() == [version]
        assert registry.load(version).model.kind == "analytic"
    finally:
        _execute(server, f'DROP DATABASE "{name}" WITH (FORCE)')


def test_client_of_another_thread_does_not_show(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv(VARIABLE, raising=False)
    registry = fresh_registry(tmp_path, "other")
    asking, answered = threading.Event(), threading.Event()

    def ask() -> None:
        with registry.connection.client():
            asking.set()
            answered.wait(10)

    with ThreadPoolExecutor(2) as pool:
        client = pool.submit(ask)
        assert asking.wait(30) and VARIABLE not in os.environ
        place = pool.submit(
            lambda: storage_for(f"sqlite:///{tmp_path / 'lab.db'}", user_environment())
        )
        assert not place.done()
        answered.set()
        client.result(30)
        assert place.result(30).database == tmp_path / "lab-models.db"
