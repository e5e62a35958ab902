"""Models as a page shows them, held to what the command line says of the same registry."""

from __future__ import annotations

import json

import numpy as np
import pytest
from pyroshock.app.common import model_registry
from pyroshock.app.operations.laboratory import Laboratory
from pyroshock.app.operations.train.figures import (
    LEVELS,
    held_out_figures,
    side_by_side,
    version_row,
)
from pyroshock.app.operations.train.listed_models import MODEL_LIST, ModelList
from pyroshock.app.operations.train.tables import json_row
from pyroshock.training.evaluation.metrics import METRICS
from pyroshock.training.fitting.session import train
from pyroshock.training.models.base import ContactPrediction
from pyroshock.training.registry.evaluate import Evaluation
from pyroshock.training.registry.listing import row_of
from pyroshock.training.registry.promotion import promote
from support.records.pulse_tables import held_out, pulse_table
from support.stores.registries import (
    context_in,
    fresh_registry,
    without_figures,
    without_judging_the_first,
)


@pytest.fixture(scope="module")
def trained(tmp_path_factory):
    """A tree, a line and hann's pulse, which knows no spread, of the synthetic hammer campaign; the
    tree is in use."""
    with pytest.MonkeyPatch.context() as patch:
        patch.delenv("MLFLOW_TRACKING_URI", raising=False)
        without_figures(patch)
        without_judging_the_first(patch)
        registry = fresh_registry(tmp_path_factory.mktemp("lab"))
        training_context = context_in(registry)
        train(registry, training_context, ["tree", "linear", "hann"], ["repetitions"])
        train(registry, training_context, ["linear"], ["configurations"])
        promote(
            registry,
            "tree",
            1,
            lambda _: training_context.table,
            forced=True,
            reason="to begin with",
        )
        yield registry, training_context.table


@pytest.fixture
def read(trained):
    return lambda _hash: trained[1]


@pytest.fixture
def listed(trained, monkeypatch):
    """The rows of the list of models, as the network has them."""
    monkeypatch.setattr(model_registry, "registry_at", lambda _: trained[0])
    laboratory = Laboratory(None, "sqlite:///none.db")
    return lambda **choice: MODEL_LIST.answer(
        ModelList(**choice), laboratory, lambda *_: None
    ).to_network_json()


def version_of(trained, label: str, split: str = "repetitions"):
    records = trained[0].versions()
    return next(record for record in records if (record.label, record.split) == (label, split))


def test_rows_tell_what_the_command_line_tells_and_are_filtered(trained, listed):
    registry, _ = trained
    by_split = {(row["label"], row["split"]): row for row in listed()}
    assert by_split.keys() == {
        (f"{name}@1", "repetitions") for name in ("tree", "linear", "hann")
    } | {("linear@1", "configurations")}
    for version in registry.versions():
        json_figures, row = (
            json_row(version, registry.floors(version.dataset.hash, version.seed)),
            by_split[version.label, version.split],
        )
        for name in METRICS:
            assert row["metrics"][name]["mean"] == json_figures["metrics"][name]
            assert row["metrics"][name]["ci90"] == json_figures["ci90"][name]
            assert (
                row["metrics"][name]["floor"]["treatment"]
                == json_figures["floor"]["treatment"][name]
            )
            assert row["metrics"][name]["thesis"] == (json_figures["thesis"] or {}).get(name)
        assert row["dataset_hash"] == version.dataset.hash
    rows = {label: row for (label, split), row in by_split.items() if split == "repetitions"}
    assert rows["linear@1"]["metrics"]["force_nrmse"]["thesis"] == 0.9932  # Table 4.5
    assert [label for label, row in rows.items() if row["champion"]] == ["tree@1"]
    assert rows["tree@1"]["champion_of"] == "hammer"
    json.dumps(list(rows.values()), allow_nan=False)
    assert [row["label"] for row in listed(split="configurations")] == ["linear@1"]
    assert len(listed(dataset="spring", every=True)) == 4
    with pytest.raises(LookupError, match="no model of a dataset 'winter'"):
        listed(dataset="winter")


def test_versions_side_by_side_differ_as_their_means_do_and_one_alone_is_refused(trained, read):
    compared = side_by_side(
        trained[0], [version_of(trained, label) for label in ("linear@1", "tree@1")], read
    )
    assert [model["label"] for model in compared["models"]] == ["tree@1", "linear@1"] and compared[
        "pulses"
    ] == 60
    assert [row["metric"] for row in compared["differences"]] == list(METRICS)
    means = {model["label"]: model["metrics"] for model in compared["models"]}
    for row in compared["differences"]:
        difference = means[row["a"]][row["metric"]] - means[row["b"]][row["metric"]]
        assert row["difference"] == pytest.approx(difference)
        assert row["ci90"][0] <= row["difference"] <= row["ci90"][1] and 0 < row["p_value"] <= 1
    json.dumps(compared, allow_nan=False)
    tree_version = version_of(trained, "tree@1")
    with pytest.raises(ValueError, match="2 versions to compare; choose two or more"):
        side_by_side(trained[0], [tree_version, tree_version], read)
    other = pulse_table(np.random.default_rng(9), repetitions=3, campaign="other")
    table, _ = held_out(other, np.random.default_rng(0))
    with pytest.raises(ValueError, match="60 held-out pulses are in no dataset of the store"):
        held_out_figures(trained[0], tree_version, lambda _: table)
    without_floor = version_row(tree_version, {})["metrics"]["cost"]["floor"]
    assert without_floor == {"configuration": None, "treatment": None}


def test_points_are_the_held_out_pulses_with_intervals_where_the_model_has_them(trained, read):
    registry, table = trained
    version = version_of(trained, "linear@1")
    points = held_out_figures(registry, version, read)["points"]
    rows = [table.key.tolist().index(key) for key in points["key"]]
    assert set(points["key"]) == set(registry.held_out(version).keys.tolist())
    assert points["peak_force_n"]["measured"] == table.peak_force_n[rows].tolist()
    assert points["contact_time_s"]["measured"] == table.contact_time_s[rows].tolist()
    error = np.abs(
        np.divide(points["contact_time_s"]["predicted"], points["contact_time_s"]["measured"]) - 1
    )
    assert error.mean() == pytest.approx(row_of(version)["metrics"]["contact_time_error"])
    error = np.abs(
        np.divide(points["peak_force_n"]["predicted"], points["peak_force_n"]["measured"]) - 1
    )
    assert error.mean() == pytest.approx(row_of(version)["metrics"]["peak_force_error"])
    with_spread = set()
    for version in trained[0].versions():
        model_figures, stored_coverage = (
            held_out_figures(trained[0], version, read),
            row_of(version)["coverage90"],
        )
        with_spread.add(stored_coverage is not None)
        peak, coverage = model_figures["points"]["peak_force_n"], model_figures["coverage"]
        assert (peak["low"] is None) == (coverage["force"] is None) == (stored_coverage is None)
        if stored_coverage is not None:
            columns = (peak["low"], peak["predicted"], peak["high"])
            assert coverage["force"][LEVELS.index(0.90)] == pytest.approx(
                stored_coverage["force_covered"], abs=1e-3
            )
            assert coverage["time"][LEVELS.index(0.90)] == pytest.approx(
                stored_coverage["time_covered"], abs=1e-3
            )
            assert all(low < value < high for low, value, high in zip(*columns, strict=True))
        json.dumps(model_figures, allow_nan=False)
    assert with_spread == {True, False}


def test_coverage_of_known_scatter_is_the_level(monkeypatch):
    """Measured pulses scatter by 10 N and 10 us about what is predicted, and the model says so."""
    rng = np.random.default_rng(3)
    pulses = pulse_table(rng, repetitions=40)
    n = len(pulses)
    prediction = ContactPrediction(
        pulses.force_n + 10 * rng.standard_normal(pulses.force_n.shape),
        pulses.contact_time_s + 1e-5 * rng.standard_normal(n),
        np.full(pulses.force_n.shape, 10.0),
        np.full(n, 1e-5),
    )
    judged = Evaluation(pulses, {}, {"law@1": prediction}, {})
    monkeypatch.setattr("pyroshock.training.registry.evaluate.evaluate_held_out", lambda *_: judged)

    class Law:
        label = "law@1"

    found = held_out_figures(None, Law(), lambda _: pulses, most=100)
    assert found["coverage"]["force"] == pytest.approx(LEVELS, abs=0.01)
    assert found["coverage"]["time"] == pytest.approx(LEVELS, abs=0.03)
    points = found["points"]
    assert (found["pulses"], len(points["key"])) == (n, 100)
    assert np.subtract(
        points["peak_force_n"]["high"], points["peak_force_n"]["low"]
    ) == pytest.approx(32.9)


def test_version_whose_files_are_damaged_is_marked(trained, listed):
    registry, _ = trained
    with registry._model_of(version_of(trained, "hann@1")) as folder:
        file = folder / "model.json"
    kept = file.read_bytes()
    file.write_bytes(b"{}")
    try:
        wrong = {row["label"]: row["damaged"] for row in listed()}
    finally:
        file.write_bytes(kept)
    assert [label for label, what in wrong.items() if what] == ["hann@1"] and "model.json" in wrong[
        "hann@1"
    ]
