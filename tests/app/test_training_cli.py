"""`train`, `models`, `compare`, `promote`: forms that scripts rely on, and one line for what a user
can mend."""

from __future__ import annotations

import builtins
import json
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from click import Command
from click.testing import CliRunner, Result
from pyroshock.app.doors.command_line.operation_command import command_of
from pyroshock.app.doors.command_line.operation_group import OperationGroup
from pyroshock.app.operations.train.compare import COMPARE
from pyroshock.app.operations.train.promote import PROMOTE
from pyroshock.app.operations.train.train import TRAIN
from pyroshock.dataset.predictors import shipped
from pyroshock.dataset.table import PulseTable
from pyroshock.training.estimators.base import FitReport
from pyroshock.training.evaluation.metrics import METRICS
from pyroshock.training.models.analytic import Analytic
from pyroshock.training.tuning.trials import SettingsSearch, Trial
from support.records.campaigns import blows, force_record, recording_name, write_recording
from support.records.pulse_tables import PREDICTORS, pulse_table
from support.stores.hammer_stores import HITS, filled_store, full_campaign, rows_of
from support.stores.registries import fresh_registry, without_figures, without_judging_the_first
from support.stores.stores import opened

train, compare, promote = map(command_of, (TRAIN, COMPARE, PROMOTE))
models = OperationGroup("models")
COMMANDS = {"train": train, "models": models, "compare": compare, "promote": promote}
HASH = "5" * 64


@dataclass
class _Snapshot:
    """What `read_snapshot` gives, of a table made here."""

    name: str
    hash: str
    table: PulseTable
    predictors = shipped("hammer")

    @property
    def definition(self) -> dict[str, object]:
        return {"velocity": {"kind": "before contact"}}


@pytest.fixture
def lab(request, tmp_path, monkeypatch):
    """A store whose dataset `spring` is a synthetic campaign; gives the command line.

    A parameter is the scatter of its repetitions.
    """
    url = f"sqlite:///{tmp_path / 'lab.db'}"
    with opened(url, create=True):
        pass
    fresh_registry(tmp_path)
    without_figures(monkeypatch)
    monkeypatch.delenv("MLFLOW_TRACKING_URI", raising=False)
    noise = getattr(request, "param", 0.02)
    tables = {"spring": pulse_table(np.random.default_rng(1), repetitions=3, noise=noise)}
    tables["autumn"] = pulse_table(np.random.default_rng(2), repetitions=2, campaign="autumn")

    def read(_source: object, name: str) -> _Snapshot:
        name = "spring" if name == HASH else name
        if name not in tables:
            raise LookupError(f"no dataset {name!r} in the store; there: {', '.join(tables)}")
        return _Snapshot(name, HASH if name == "spring" else "a" * 64, tables[name])

    monkeypatch.setattr("pyroshock.dataset.snapshot.read_snapshot", read)
    monkeypatch.setattr(
        "pyroshock.dataset.snapshot.list_snapshots", lambda _: [{"name": name} for name in tables]
    )

    def run(*words: str | Path) -> Result:
        command, *rest = map(str, words)
        result = CliRunner().invoke(COMMANDS[command], [*rest, "--db", url])
        if result.exception is not None and not isinstance(result.exception, SystemExit):
            raise result.exception
        return result

    return run


def done(result: Result) -> Result:
    assert result.exit_code == 0, result.stderr
    return result


def test_gun_models_have_no_figures_of_the_thesis(lab, monkeypatch):
    monkeypatch.setattr(_Snapshot, "predictors", shipped("gun"))
    rows = json.loads(done(lab("train", "spring", "--models", "linear", "--json")).stdout)
    assert [row["thesis"] for row in rows] == [None, None]


def test_table_shows_both_splits_the_floor_and_the_thesis(lab):
    table = done(lab("train", "spring", "--models", "tree,hann,linear")).stdout.splitlines()
    heads = table[0].split("  ")
    assert {"NRMSE rep.", "NRMSE conf.", "NRMSE thesis", "cost conf."} <= {
        head.strip() for head in heads
    }
    names = [line.split("  ")[0] for line in table[1:]]
    assert {"(floor by treatment)", "(floor by configuration)"} < set(names)
    assert names.index("tree") < names.index("hann")
    column = slice(table[0].index("time thesis"), table[0].index("impulse rep."))
    tree = next(line for line in table if line.startswith("tree"))
    assert tree[column].strip() == "0.0581"  # Table 4.4


def test_compare_tells_which_is_better_of_two_or_all(lab, tmp_path):
    done(lab("train", "spring", "--models", "hertz,hann", "--split", "repetitions"))
    rows = json.loads(done(lab("compare", "hertz", "hann@1", "--json")).stdout)
    models = [row for row in rows if "model" in row]
    (pair,) = (row for row in rows if "a" in row)
    assert [row["model"] for row in models] == ["hertz", "hann"]
    assert (pair["a"], pair["b"], pair["metric"]) == ("hertz@1", "hann@1", "force_nrmse")
    difference = models[0]["metrics"]["force_nrmse"] - models[1]["metrics"]["force_nrmse"]
    assert (
        pair["difference"] == pytest.approx(difference)
        and pair["ci90"][0] < difference < pair["ci90"][1] < 0
    )
    assert pair["p_value"] < 0.05
    done(lab("train", "spring", "--models", "hertz,hann,hunt-crossley", "--split", "repetitions"))
    result = done(lab("compare", "--metric", "cost", "--out", tmp_path / "d.png"))
    assert result.stdout.count("hertz@1 is better than") >= 2
    assert "60 held-out pulses on which none of the models was trained" in result.stdout
    assert (tmp_path / "d.png").read_bytes().startswith(b"\x89PNG")
    every = json.loads(done(lab("compare", "--metric", "all", "--json")).stdout)
    assert len([row for row in every if "a" in row]) == 2 * len(METRICS)


@pytest.fixture
def reporting_laws(monkeypatch):
    """Laws that say they have searched something: what is shown must not depend on a slow
    search."""

    def report(law):
        settings = {"force.kernel": law.law, "force.noise": 0.25}
        trials = tuple(Trial({"rank": rank}, 1.0 / rank, 0.5) for rank in (1, 2, 3))
        searches = (
            {"force": SettingsSearch("grid search", "error", trials)} if law.law == "hann" else {}
        )
        rank = {"force.rank": 3} if searches else {}
        return FitReport(settings | rank, {}, {"force.loss": [2.0, 1.0]}, searches)

    monkeypatch.setattr(Analytic, "fit_report", report)


def test_compare_and_models_show_settings_and_histories(lab, reporting_laws):
    done(lab("train", "spring", "--models", "hann,hertz", "--split", "repetitions"))
    lines = done(lab("compare", "hann@1", "hertz@1")).stdout.splitlines()
    table = lines[lines.index("Settings of each training") + 1 :]
    cells = [line.split() for line in table]
    names = cells[0][1:]
    assert cells[0][0] == "setting" and set(names) == {"hann@1", "hertz@1"}
    rows = {line.split("  ")[0] for line in table[1:]}
    assert rows == {"chosen by a search", "force.kernel", "force.noise", "force.rank"}
    searched = next(line for line in table if line.startswith("chosen by a search"))
    assert sorted(searched.split()[-2:]) == ["force.rank", "none"]
    rank = next(dict(zip(names, row[1:], strict=True)) for row in cells if row[0] == "force.rank")
    assert rank == {"hann@1": "3", "hertz@1": "-"}
    rows = json.loads(done(lab("compare", "hann@1", "hertz@1", "--json")).stdout)
    kernels = {row["model"]: row["settings"]["force.kernel"] for row in rows if "model" in row}
    assert kernels == {"hann": "hann", "hertz": "hertz"}
    row = json.loads(done(lab("models", "hann@1", "--json")).stdout)
    assert row["settings"] == {"force.kernel": "hann", "force.noise": 0.25, "force.rank": 3}
    assert row["histories"] == {"force.loss": [[0, 2.0], [1, 1.0]]}
    shown = done(lab("models", "hann@1")).stdout
    assert (
        "hann@1, dataset spring, split repetitions, seed 0" in shown
        and "force.kernel  hann" in shown
    )
    assert (
        "the grid search tried 3 combinations of settings. The best has the score 0.333 (error)"
        in shown
    )
    assert "Only one setting was searched" in shown
    assert "no 'hann@7'" in lab("models", "hann@7").stderr


def test_models_show_gives_every_trial_as_json_and_draws_them(lab, reporting_laws, tmp_path):
    done(lab("train", "spring", "--models", "hann,hertz", "--split", "repetitions"))
    row = json.loads(
        done(lab("models", "show", "hann@1", "--json", "--plot", tmp_path / "search.png")).stdout
    )
    assert row["searches"]["force"]["trials"][2] == {
        "settings": {"rank": 3},
        "score": 1.0 / 3,
        "duration_s": 0.5,
    }
    assert (tmp_path / "search.png").read_bytes().startswith(b"\x89PNG")
    assert json.loads(done(lab("models", "show", "hertz@1", "--json")).stdout)["searches"] == {}
    refused = lab("models", "show", "hertz@1", "--plot", tmp_path / "none.png")
    assert refused.exit_code == 2 and "hertz@1 has no trials to draw" in refused.stderr
    assert not (tmp_path / "none.png").exists()


def test_compare_needs_pulses_in_common(lab):
    """Held out by configuration and of another campaign: no pulse is both."""
    for name in ("spring", "autumn"):
        done(lab("train", name, "--models", "hann", "--split", "repetitions"))
    result = lab("compare", "hann@1", "hann@2")
    assert result.exit_code == 2 and "no held-out pulse in common" in result.stderr


def test_a_model_far_from_the_repeatability_is_refused_as_not_usable(lab, monkeypatch):
    without_judging_the_first(monkeypatch)
    done(lab("train", "spring", "--models", "linear", "--split", "repetitions"))
    refused = lab("promote", "linear", "1", "--json")
    decision = json.loads(refused.stdout)
    assert (refused.exit_code, decision["promoted"], decision["verdict"]) == (
        1,
        False,
        "not usable",
    )
    assert (
        "linear@1 is not usable: its force error on the split repetitions is 51." in refused.stderr
    )


# With less scatter a line is not usable, and is refused before it is judged on anything.
@pytest.mark.parametrize("lab", [0.06], indirect=True)
def test_promotion_and_refusal_judged_on_either_dataset(lab, monkeypatch):
    without_judging_the_first(monkeypatch)
    done(lab("train", "spring", "--models", "hann,linear", "--split", "repetitions"))
    first = done(lab("promote", "hann@1", "--force", "--reason", "a start")).stderr
    assert "hann@1 is now in use for the hammer (none before): a start" in first
    refused = lab("promote", "linear", "1", "--json")
    assert refused.exit_code == 1 and json.loads(refused.stdout)["promoted"] is False
    stays = "linear@1 is refused, hann@1 stays in use for the hammer: hann@1 predicts unseen"
    assert stays in refused.stderr
    assert lab("promote", "linear").exit_code == lab("promote", "linear@1", "1").exit_code == 2
    rows = json.loads(done(lab("models", "--json")).stdout)
    assert {row["model"]: row.get("champion_of") for row in rows} == {
        "hann": "hammer",
        "linear": None,
    }
    assert "hann *" in done(lab("models")).stdout
    assert (
        "hann@1 and linear@1 cannot be told apart in the force error"
        in done(lab("compare", "hann@champion", "linear")).stdout
    )
    assert "versions: 1 (repetitions)" in lab("compare", "linear@2", "hann").stderr
    history = json.loads(done(lab("models", "--promotions", "--json")).stdout)
    assert [(each["candidate"], each["promoted"]) for each in history] == [
        ("linear@1", False),
        ("hann@1", True),
    ]
    refused = lab("promote", "linear", "1", "--on", "autumn")
    assert (
        refused.exit_code == 1
        and "judged on 120 pulses, unseen configurations of autumn" in refused.stderr
    )
    forced = lab("promote", "linear", "1", "--on", "autumn", "--force", "--reason", "a trial")
    trial = (
        "linear@1 is now in use for the hammer (hann@1 before): a trial; promoted by force although"
    )
    assert trial in done(forced).stderr and "a trial" in done(lab("models", "--promotions")).stdout


def test_campaign_to_promoted_model(tmp_path, monkeypatch):
    """Nothing stands in: recordings, store, dataset, training, and a judgement on another
    campaign."""
    without_figures(monkeypatch)
    monkeypatch.delenv("MLFLOW_TRACKING_URI", raising=False)
    campaigns = [("spring", 4), ("autumn", 12)]  # configurations, of which twelve judge a model
    database = filled_store(
        tmp_path, *(_scattered_campaign(tmp_path / name, name, runs) for name, runs in campaigns)
    )
    fresh_registry(tmp_path, database.stem)
    end = ["--db", f"sqlite:///{database}"]

    def run(command: Command, *words: str) -> Result:
        return CliRunner().invoke(command, [*words, *end], catch_exceptions=False)

    done(run(OperationGroup("dataset"), "build", "all-of-spring", "--from", "spring"))
    done(run(train, "all-of-spring", "--models", "linear,hertz", "--split", "repetitions"))
    refused = run(promote, "linear", "1")
    assert refused.exit_code == 3, "four configurations judge no model"
    assert (
        "linear@1 is not promoted, no model is in use for the hammer: not enough to judge"
        in refused.stderr
    )
    (row,) = json.loads(done(run(models, "--promotions", "--json")).stdout)
    assert row["judged_against"] == "nothing"
    first = done(run(promote, "linear", "1", "--force", "--reason", "the first one")).stderr
    assert "(none before): the first one; promoted by force although " in first
    judged = run(promote, "hertz", "1", "--on", "autumn", "--force", "--reason", "a law for all")
    assert "judged on 60 pulses, unseen configurations of autumn" in done(judged).stderr
    row = next(
        row for row in json.loads(done(run(models, "--json")).stdout) if row["model"] == "hertz"
    )
    assert (row["champion_of"], row["dataset"]) == ("hammer", "all-of-spring")
    lost = run(promote, "linear", "1", "--on", "winter")
    assert (lost.exit_code, "'winter' is no dataset" in lost.stderr) == (2, True)


def _scattered_campaign(folder: Path, name: str, runs: int) -> Path:
    """One configuration for each run, whose repeated hits differ by so much (25 %) that a law of
    contact is usable."""
    full_campaign(
        folder,
        name,
        runs,
        rows=[row | {"tip_radius_mm": 15 + 5 * row["run"]} for row in rows_of(runs)],
    )
    rng = np.random.default_rng(runs)
    for run in range(1, runs + 1):
        hits = [
            replace(hit, peak_n=hit.peak_n * float(np.exp(rng.normal(0, 0.25))))
            for hit in blows(run, HITS)
        ]
        write_recording(folder / recording_name(run), {"force": force_record(hits, rng)})
    return folder


@pytest.mark.parametrize(("words", "said"), [
    (("train", "winter"), "no dataset 'winter'"),
    (("train", "spring", "--models", "magic"), "no model 'magic'; there are: "),
    (("train", "spring", "--models", "hann", "--split", "halves"),
     "split is 'halves'; expected one of"),
    (("compare", "hann", "hertz"), "no models yet"),
    (("compare", "--metric", "beauty"), "--metric is 'beauty'; expected one of"),
    (("promote", "hann", "1"), "no registered model 'hann'"),
    (("models", "--dataset", "winter"), "no model of a dataset 'winter'"),
])  # fmt: skip
def test_unusable_input_is_one_line(lab, words, said):
    result = lab(*words)
    assert result.exit_code == 2 and said in result.stderr and len(result.stderr.splitlines()) == 1


def test_model_that_cannot_learn_is_told_and_the_others_listed(lab, monkeypatch):
    monkeypatch.setattr("pyroshock.training.models.analytic.Analytic.fit", _refuses)
    result = lab("train", "spring", "--models", "hann,linear", "--split", "repetitions", "--json")
    assert result.exit_code == 2 and [row["model"] for row in json.loads(result.stdout)] == [
        "linear"
    ]
    assert (
        result.stderr.splitlines()[-1]
        == "pyroshock: not trained: hann (repetitions): no hammer here"
    )


def _refuses(*_: object) -> None:
    raise ValueError("no hammer here")


@pytest.mark.parametrize(
    "words", [("train", "spring", "--models", "linear"), ("promote", "hann", "1")]
)
def test_missing_extra_says_how_to_get_it(lab, monkeypatch, words):
    """As on a laptop with `pip install pyroshock` alone, which lists the models of others."""
    done(lab("train", "spring", "--models", "hann", "--split", "repetitions"))
    really = builtins.__import__

    def without_mlflow(name, *rest, **extra):
        if name.partition(".")[0] == "mlflow":
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)
        return really(name, *rest, **extra)

    monkeypatch.setattr(builtins, "__import__", without_mlflow)
    result = lab(*words)
    assert result.exit_code == 2
    assert result.stderr.strip().endswith(
        "mlflow is not installed; models need it: pip install 'pyroshock[models]'"
    )
    assert "hann" in done(lab("models")).stdout


def test_fresh_lab_has_no_models_and_train_json_has_the_rows_of_the_contract(lab):
    assert "no models yet; train some" in done(lab("models")).stdout
    assert (
        json.loads(done(lab("models", "--json")).stdout) == []
        and shipped("hammer").predictors == PREDICTORS
    )
    result = done(lab("train", "spring", "--models", "hann,linear", "--json"))
    rows = json.loads(result.stdout)
    expected = [
        (model, 1, split)
        for split in ("repetitions", "configurations")
        for model in ("hann", "linear")
    ]
    assert [(row["model"], row["version"], row["split"]) for row in rows] == expected
    assert all(tuple(row["metrics"]) == METRICS and row["seconds"] >= 0 for row in rows)
    low, high = rows[1]["ci90"]["force_nrmse"]
    assert low < rows[1]["metrics"]["force_nrmse"] < high
    assert 0 < rows[1]["floor"]["treatment"]["force_nrmse"] < rows[1]["metrics"]["force_nrmse"]
    assert rows[1]["thesis"]["force_nrmse"] == 0.9932  # Table 4.5
    assert "linear, configurations: force NRMSE" in result.stderr
    listed = json.loads(done(lab("models", "--dataset", "spring", "--json")).stdout)
    assert sorted(map(json.dumps, listed)) == sorted(map(json.dumps, rows))
    assert json.loads(done(lab("models", "--split", "materials", "--json")).stdout) == []
    again = done(lab("train", "spring", "--models", "hann")).stderr
    assert "0 models trained now; 2 models registered already" in again
