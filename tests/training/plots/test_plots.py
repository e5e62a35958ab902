"""Pictures show the numbers they are given."""

from __future__ import annotations

import io

import numpy as np
import pytest
from matplotlib.figure import Figure
from pyroshock.dataset.table import POINTS, PulseTable, concatenate
from pyroshock.training.evaluation.coverage import LEVELS, coverage
from pyroshock.training.evaluation.metrics import PulseErrors, pulse_errors
from pyroshock.training.models.base import ContactPrediction
from pyroshock.training.plots.held_out import (
    by_test,
    coverage_figure,
    heat_map,
    pulse_grid,
)
from pyroshock.training.plots.style import runs_of
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


def written(figure: Figure) -> bytes:
    file = io.BytesIO()
    figure.savefig(file, format="png", dpi=40)
    return file.getvalue()


def test_heat_map_ranks_models_and_each_has_a_panel_by_test(
    pulses: PulseTable, errors: dict[str, PulseErrors]
) -> None:
    figure = heat_map(pulses, errors)
    upper = figure.axes[0]
    assert [label.get_text() for label in upper.get_yticklabels()] == ["b", "c", "a"]
    shown = np.asarray(upper.images[0].get_array())
    assert shown.shape == (3, 60)
    first = pulses.run == pulses.run.min()
    assert np.isclose(shown[2, 0], errors["a"].force_nrmse[first].mean())
    assert written(figure)
    figure = by_test(pulses, errors, "force_nrmse")
    assert [axes.get_title(loc="left")[0] for axes in figure.axes] == ["b", "c", "a"]
    assert figure.axes[0].get_yscale() == "log"
    drawn = sum(
        np.size(line.get_xdata()) for line in figure.axes[0].lines if line.get_marker() == "o"
    )
    assert drawn == 60
    assert written(figure)
    assert by_test(pulses, {"a": errors["a"]}, "peak_force_error").axes[0].get_yscale() == "linear"


def test_pulse_grid_shows_the_worst(pulses: PulseTable) -> None:
    figure = pulse_grid(pulses, off_by(pulses, 0.05))
    assert len(figure.axes) == 3 * 4
    aluminum = pulses.tip_material == "aluminum"
    worst = pulse_errors(pulses, off_by(pulses, 0.05)).force_nrmse[aluminum].max()
    assert f"NRMSE {worst:.3f} (worst)" in figure.axes[3].get_title()
    assert written(figure)
    figure = pulse_grid(pulses, off_by(pulses, 0.05, spread=False))
    assert not figure.axes[0].collections and not figure.axes[0].patches


def test_coverage_leaves_out_models_without_spread(pulses: PulseTable) -> None:
    # 20,000 errors: five standard errors are 0.018 in the middle.
    assert np.abs(coverage(np.random.default_rng(0).standard_normal(20_000)) - LEVELS).max() < 0.018
    predictions = {"sure": off_by(pulses, 0.01), "law": off_by(pulses, 0.01, spread=False)}
    legend = coverage_figure(pulses, predictions).axes[0].get_legend()
    assert [text.get_text()[:4] for text in legend.get_texts()] == ["sure"]
    figure = coverage_figure(pulses, {"law": off_by(pulses, 0.01, spread=False)})
    assert figure.axes[0].get_legend() is None
    assert written(figure)


def test_runs_of_two_campaigns_stay_apart() -> None:
    tables = [
        pulse_table(np.random.default_rng(0), repetitions=2, campaign=name)
        for name in ("spring", "autumn")
    ]
    runs = runs_of(concatenate(tables))
    assert len(runs) == 120
    assert runs.label[0] == "autumn 1" and runs.label[60] == "spring 1"
    assert runs.member[0] == 60
    table = pulse_table(np.random.default_rng(0), repetitions=2)
    values = np.arange(120.0)
    assert np.array_equal(runs_of(table).mean(values), np.arange(60) * 2 + 0.5)
