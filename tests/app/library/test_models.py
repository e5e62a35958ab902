"""Datasets, trainings, comparisons, promotions, predictions and pictures of models, as a notebook
makes them."""

from __future__ import annotations

import json

import matplotlib as mpl
import numpy as np
import pandas as pd
import pyroshock as ps
import pytest
from click.testing import CliRunner
from pyroshock.app.doors.command_line.main import main
from pyroshock.app.operations.train.contact_model import ContactPulses
from scipy.stats import norm
from support.stores.hammer_stores import full_campaign
from support.stores.registries import fresh_registry, without_figures


@pytest.fixture(scope="module")
def lab(tmp_path_factory):
    """A store with a dataset, and two laws of contact that are registered in a second."""
    folder = tmp_path_factory.mktemp("models")
    mpl.use("Agg")
    fresh_registry(folder, "lab")
    with pytest.MonkeyPatch.context() as patch, ps.open(folder / "lab.db") as store:
        without_figures(patch)
        store.ingest(full_campaign(folder / "spring"), progress=False)
        data = store.dataset("spring-1", campaigns=["spring"])
        yield (
            store,
            data,
            store.train(data, models=["linear", "reed"], splits="repetitions", progress=False),
        )


def _printed(store, *words):
    result = CliRunner().invoke(main, [*words, "--db", store.url, "--json"])
    assert result.exit_code in (0, 1), result.output
    return json.loads(result.stdout)


def test_trained_models_are_those_of_the_command_line_and_are_trained_once(lab):
    store, _, runs = lab
    assert runs.labels == ["linear@1", "reed@1"] and runs.trained == 2
    frame = runs.to_frame().set_index("model")
    printed = {f"{row['model']}@{row['version']}": row for row in _printed(store, "models")}
    assert set(frame.index) == set(printed)
    for label, row in printed.items():
        assert frame["force_nrmse"][label] == row["metrics"]["force_nrmse"]
    axes = runs.plot()
    assert next(tick.get_text() for tick in axes.get_yticklabels()).startswith(
        frame["force_nrmse"].idxmin()
    )
    assert "linear@1" in runs._repr_html_()
    store, data, _ = lab
    again = store.train(data, models="linear", splits=["repetitions"], progress=False)
    assert again.trained == 0 and again.labels == ["linear@1"]


def test_a_model_predicts_the_pulses_of_a_frame_with_what_the_bench_says(lab):
    _, data, _ = lab
    frame, table = data.to_frame(), data.snapshot.table
    for name in ("impactor_mass_kg", "plate_thickness_m"):
        np.testing.assert_array_equal(frame[name], getattr(table, name))
        assert frame.attrs["units"][name] == name.rpartition("_")[2]
    store, data, _ = lab
    frame = data.to_frame().set_index("key")
    pulses = store.model("linear@1").predict(frame)
    predicted = pulses.to_frame()
    assert predicted.index.equals(frame.index) and predicted.attrs["units"]["force_07_n"] == "N"
    answer = store.model("linear")._registered.predict(data.snapshot.table)
    direct = answer.prediction
    np.testing.assert_array_equal(predicted["contact_time_s"], direct.contact_time_s)
    np.testing.assert_array_equal(predicted["force_spread_20_n"], direct.force_spread_n[:, 19])
    assert [bool(sentence) for sentence in predicted["extrapolation"]] == [
        bool(each) for each in answer.outside
    ]
    assert len(pulses.plot().get_lines()) == len(frame)
    store, data, _ = lab
    frame = data.to_frame().head(1).assign(impact_velocity_m_s=50.0)
    (sentence,) = store.model("linear@1").predict(frame).extrapolation
    assert sentence.startswith("impact_velocity = 50 lies beyond")


def test_a_comparison_says_what_the_command_says(lab):
    store, _, runs = lab
    comparison = store.compare(*runs.labels)
    rows = _printed(store, "compare", *runs.labels)
    (verdict,) = (row["verdict"] for row in rows if "verdict" in row)
    (unusable,) = (row["not_usable"] for row in rows if row.get("not_usable"))
    assert unusable.startswith("reed@1 is not usable: its force error")
    assert [str(said) for said in comparison.sentences()][1:3] == [f"{unusable}.", verdict]
    assert set(comparison.to_frame()["model"]) == set(runs.labels)
    assert comparison.plot().get_xlabel().startswith("force_nrmse of")


@pytest.mark.parametrize(("change", "kind", "words"), [
    ({"tip_material": "cheese"}, ps.InvalidValueError,
     "tip_material is 'cheese' in row 0; expected one of"),
    ({"impact_velocity_m_s": "fast"}, ps.InvalidValueError,
     "impact_velocity_m_s has a value that is no number"),
    ({"impact_velocity_m_s": None}, ps.NotFoundError, "no column 'impact_velocity_m_s'"),
])  # fmt: skip
def test_a_frame_that_does_not_fit_is_refused(lab, change, kind, words):
    store, data, _ = lab
    model = store.model("linear@1")
    name, value = next(iter(change.items()))
    if name not in model.columns:  # materials are described by their numbers
        name = next(column for column, levels in model.columns.items() if "," in levels)
        words = words.replace("tip_material", name)
    frame = data.to_frame()
    frame = frame.drop(columns=name) if value is None else frame.assign(**{name: value})
    with pytest.raises(kind, match=words):
        model.predict(frame)


@pytest.mark.parametrize(("call", "kind", "words"), [
    (lambda store: store.model("reeds"), ps.NotFoundError, "no registered model 'reeds'"),
    (lambda store: store.compare("reed@1"), ps.InvalidValueError, "a comparison needs two models"),
    (lambda store: store.compare(metric="speed"), ps.InvalidValueError, "metric is 'speed'"),
    (lambda store: store.promote("reed"), ps.InvalidValueError, "expected MODEL@VERSION"),
    (lambda store: store.promote("reed@1", force=True), ps.InvalidValueError, "reason"),
    (lambda store: store.train("spring-1", models="forest"), ps.PyroshockError, "forest"),
    (lambda store: store.train("autumn"), ps.NotFoundError, "autumn"),
    (lambda store: store.train("spring-1", budget="huge"), ps.InvalidValueError,
     "budget is 'huge'"),
    (lambda store: store.dataset("spring-1", campaigns=["autumn"]), ps.NotFoundError, "autumn"),
])  # fmt: skip
def test_what_is_wrong_is_named(lab, call, kind, words):
    with pytest.raises(kind, match=words):
        call(lab[0])


def test_a_promotion_puts_a_model_in_use(lab):
    store, _, _ = lab
    decision = store.promote("reed@1", force=True, reason="to begin with")
    assert decision.promoted and "reed@1 is now in use for the hammer" in decision.sentence
    in_use = store.models().set_index("model")["in_use"]
    assert in_use["reed@1"] == "hammer" and in_use["linear@1"] == ""
    assert isinstance(store.models(split="repetitions"), pd.DataFrame)


def test_drawn_band_holds_nine_of_ten_pulses() -> None:
    from matplotlib.figure import Figure

    force_n, spread_n = np.full((1, 20), 4e3), np.full((1, 20), 500.0)
    pulses = ContactPulses(
        "tree@1", force_n, np.array([1e-3]), spread_n, None, ("",), pd.RangeIndex(1)
    )
    axes = pulses.plot(Figure().add_subplot())
    edges_kn = axes.collections[0].get_paths()[0].vertices[:, 1]
    lower, upper = norm.interval(0.9, loc=4.0, scale=0.5)
    assert (edges_kn.min(), edges_kn.max()) == pytest.approx((lower, upper), abs=1e-3)
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("time since first contact (ms)", "force (kN)")
