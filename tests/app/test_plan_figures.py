"""Figures of plans: a column for each design, on scales that no design sets."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from pyroshock.app.figures.figure import BarSeries, HeatMap
from pyroshock.app.figures.matplotlib_renderer import matplotlib_figure
from pyroshock.app.operations.plan.figures import coverage_figure, quality_figure, triples_figure
from pyroshock.doe.space import gun_space
from support.checks.drawn_series import series_of

GUN = gun_space()
SIZES = [axis.size for axis in GUN.axes]


def test_quality_has_a_column_for_each_design_on_common_scales() -> None:
    every = GUN.all_treatments()
    figure = quality_figure(GUN, {"every": every, "some": every[::7]})
    pairs, effects, triples, runs = figure.rows
    assert [plot.title for plot in pairs] == [f"every: {len(every)} runs", "some: 116 runs"]
    maps = [own for plot in (*pairs, *effects) for own in series_of(plot)]
    assert all(isinstance(own, HeatMap) for own in maps)
    assert {own.colour_limits() for own in maps} == {(-1.0, 1.0), (0.0, 1.0)}
    assert maps[0].values.shape == (sum(SIZES), sum(SIZES))
    assert triples[0].limits("x") == triples[1].limits("x")
    assert series_of(runs[1])[0].values.shape == (len(SIZES), 116)


def test_a_single_factor_has_no_triples_and_is_drawn_all_the_same() -> None:
    space = replace(GUN, factors=GUN.factors[:1], axes=GUN.axes[:1], rules=())
    assert triples_figure(space, space.all_treatments()).series == ()
    assert len(matplotlib_figure(quality_figure(space, {"two": space.all_treatments()})).axes) > 3


@pytest.mark.parametrize("drawn", [{}, {"none": np.zeros((0, 6), dtype=np.int64)}])
def test_nothing_to_draw_is_refused(drawn: dict[str, NDArray[np.int64]]) -> None:
    with pytest.raises(ValueError, match="expected at least one"):
        quality_figure(GUN, drawn)


def test_runs_of_a_level_stand_upon_each_other() -> None:
    levels = [
        {"factor": "tip_radius", "level": 0.03, "done": 3, "planned": 2, "discarded": 1},
        {"factor": "insulator", "level": "none", "done": 9, "planned": 9, "discarded": 9},
    ]
    bars = series_of(coverage_figure(levels, "tip_radius"))
    assert all(isinstance(own, BarSeries) for own in bars)
    assert [(own.name, own.base.tolist(), own.end.tolist()) for own in bars] == [
        ("done", [0.0], [3.0]),
        ("planned", [3.0], [5.0]),
        ("discarded", [5.0], [6.0]),
    ]
