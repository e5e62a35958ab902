"""Figures of models show the numbers they are given."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.app.figures.figure import BandSeries, HeatMap, PointSeries
from pyroshock.app.operations.train.charts import comparison_figure
from pyroshock.app.operations.train.registered_figures import (
    RegisteredFigures,
    by_test_figure,
    errors_figure,
    intervals_figure,
    pulses_figure,
)
from pyroshock.dataset.table import POINTS, PulseTable
from pyroshock.training.evaluation.comparison import compare, comparison_groups
from pyroshock.training.evaluation.metrics import PulseErrors, pulse_errors
from pyroshock.training.models.base import ContactPrediction
from support.records.pulse_tables import held_out, pulse_table


@pytest.fixture(scope="module")
def pulses() -> PulseTable:
    rng = np.random.default_rng(0)
    return held_out(pulse_table(rng, repetitions=3), rng)[1]


def off_by(pulses: PulseTable, force: float, spread: bool = True) -> ContactPrediction:
    spreads = (
        (np.full((len(pulses), POINTS), 20.0), 0.02 * pulses.contact_time_s)
        if spread
        else (None, None)
    )
    return ContactPrediction(
        (1 + force) * pulses.force_n, (1 - force) * pulses.contact_time_s, *spreads
    )


@pytest.fixture(scope="module")
def errors(pulses: PulseTable) -> dict[str, PulseErrors]:
    """Names sort otherwise than the models do; one errs a hundred times as much as another."""
    return {
        name: pulse_errors(pulses, off_by(pulses, e))
        for name, e in (("a", 0.3), ("b", 0.003), ("c", 0.02))
    }


def test_errors_rank_models_and_each_has_a_plot_by_test(
    pulses: PulseTable, errors: dict[str, PulseErrors]
) -> None:
    upper, tips = errors_figure(pulses, errors).plots()
    assert [name[0] for name in upper.y.categories] == ["b", "c", "a"]
    (shown,) = upper.series
    assert isinstance(shown, HeatMap) and shown.values.shape == (3, 60)
    first = pulses.run == pulses.run.min()
    assert np.isclose(shown.values[2, 0], errors["a"].force_nrmse[first].mean())
    assert sum(own.x.size for own in tips.series if isinstance(own, PointSeries)) == 60
    plots = list(by_test_figure(pulses, errors, "force_nrmse").plots())
    assert [plot.title[0] for plot in plots] == ["b", "c", "a"]
    assert {plot.y.scale for plot in plots} == {"log"}
    assert sum(own.x.size for own in plots[0].series if isinstance(own, PointSeries)) == 60
    (alone,) = by_test_figure(pulses, {"a": errors["a"]}, "peak_force_error").plots()
    assert alone.y.scale == "linear"


def test_pulses_show_the_worst(pulses: PulseTable) -> None:
    figure = pulses_figure(pulses, off_by(pulses, 0.05))
    assert [len(row) for row in figure.rows] == [4, 4, 4]
    aluminum = pulses.tip_material == "aluminum"
    worst = pulse_errors(pulses, off_by(pulses, 0.05)).force_nrmse[aluminum].max()
    assert f"NRMSE {worst:.3f} (worst)" in figure.rows[0][3].title
    assert any(isinstance(own, BandSeries) for own in figure.rows[0][0].series)
    plain = pulses_figure(pulses, off_by(pulses, 0.05, spread=False)).rows[0][0]
    assert not plain.regions
    assert not any(isinstance(own, BandSeries) for own in plain.series)


def test_a_comparison_has_every_group(pulses: PulseTable, errors: dict[str, PulseErrors]) -> None:
    def compared(groups: dict[str, np.ndarray]):
        rng = np.random.default_rng(0)
        pair = errors["a"], errors["b"]
        return comparison_figure(compare(*pair, pulses.configuration, groups, rng, resamples=50))

    groups = comparison_groups(pulses)
    ((_, by_group),) = compared(groups).rows
    labels = by_group.y.categories
    assert len(labels) == sum(len(np.unique(values)) for values in groups.values())
    assert "insulator: polymeric" in labels
    assert sum(own.x.size for own in by_group.series) == len(labels)
    assert len(list(compared({}).plots())) == 1


def test_coverage_leaves_out_models_without_spread(pulses: PulseTable) -> None:
    predictions = {"sure": off_by(pulses, 0.01), "law": off_by(pulses, 0.01, spread=False)}
    force, _ = intervals_figure(pulses, predictions).plots()
    assert [name[:4] for name in force.legend()] == ["sure", "want"]
    force, _ = intervals_figure(pulses, {"law": predictions["law"]}).plots()
    assert force.legend() == ("wanted at 0.90",)


def test_a_model_keeps_four_pictures(pulses: PulseTable) -> None:
    prediction = off_by(pulses, 0.05)
    files = RegisteredFigures().of_model("a", pulses, prediction, pulse_errors(pulses, prediction))
    assert files.keys() == {
        "pulses.png",
        "nrmse_by_test.png",
        "cost_by_test.png",
        "impulse_error_by_test.png",
    }
    assert all(content.startswith(b"\x89PNG") for content in files.values())
