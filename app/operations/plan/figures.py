"""Figures of plans: how even levels and pairs of levels are, what is confounded, and the order of
the runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ....array_types import Floats, Levels
from ....doe.merit.model_terms import interaction_terms, main_terms, term_correlations
from ....doe.merit.pair_balance import level_labels, pair_matrix
from ....doe.merit.space_filling import deviations
from ....doe.space import Space
from ...common.quantities import cell, heading
from ...figures.figure import (
    DIMENSIONLESS,
    BarSeries,
    ColourRole,
    HeatMap,
    Plot,
    PlotAxis,
    PlotGrid,
    PlotSeries,
    ReferenceLine,
    ReferenceRegion,
    StepSeries,
    as_floats,
    category,
)

_RUNS = PlotAxis("runs", DIMENSIONLESS, whole=True, from_zero=True)
#: Heights in px of a page: matrices are as high as they are wide.
_SQUARE, _FLAT = 576.0, 230.0
#: Names on a matrix, beyond which they would be specks.
_MOST_NAMES = 60
#: Runs above or below the share that the histogram of triples shows; what is further off is counted
#: at its ends.
_REACH = 5.0


def balance_figure(axis: Mapping[str, Any]) -> Plot:
    """Runs of each level of one axis (`quality.plan_page`), beside the balanced share."""
    levels = tuple(str(level["level"]) for level in axis["levels"])
    runs = as_floats([level["runs"] for level in axis["levels"]])
    bars = BarSeries(np.arange(len(levels), dtype=np.float64), runs, detail="runs")
    share = ReferenceLine("y", axis["share"])
    name = axis["axis"].replace("_", " ")
    return Plot(f"Runs by {name}", PlotAxis(name, categories=levels), _RUNS, (bars,), (share,))


def coverage_figure(levels: Sequence[Mapping[str, Any]], factor: str) -> Plot:
    """Planned, done and discarded runs of each level of one factor, upon each other
    (`design_coverage.level_coverage`)."""
    rows = [row for row in levels if row["factor"] == factor]
    position, base = np.arange(len(rows), dtype=np.float64), np.zeros(len(rows))
    series = []
    for state, role in (("done", 2), ("planned", 7), ("discarded", 1)):
        runs = as_floats([row[state] for row in rows])
        words = tuple(f"{number:g} runs" for number in runs)
        bars = BarSeries(position, base + runs, base, labels=words, name=state, role=category(role))
        series.append(bars)
        base = base + runs
    names = tuple(cell(factor, row["level"]) for row in rows)
    title = heading(factor)
    return Plot(f"Runs by {title}", PlotAxis(title, categories=names), _RUNS, tuple(series))


def pairs_figure(labels: Sequence[str], matrix: Floats, title: str = "Pairs of levels") -> Plot:
    """Every pair of levels (`pair_matrix`), from -1 for an empty one to 1 for twice its share."""
    colour = PlotAxis("runs beyond the balanced share, over the share", "1", limits=(-1.0, 1.0))
    return _matrix(title, "level", labels, HeatMap(matrix, colour, "diverging", detail="pairs"))


def correlation_figure(names: Sequence[str], matrix: Floats, title: str = "Effects") -> Plot:
    """How far each two effects go together, from 0 to 1."""
    colour = PlotAxis("correlation of two effects", DIMENSIONLESS, limits=(0.0, 1.0))
    shown = [name.replace("_", " ") for name in names]
    return _matrix(title, "effect", shown, HeatMap(matrix, colour, detail="correlations"))


def _matrix(title: str, what: str, names: Sequence[str], values: HeatMap) -> Plot:
    axes = (
        PlotAxis(what, categories=tuple(names)),
        PlotAxis(what, categories=tuple(names), reversed=True),
    )
    return Plot(title, *axes, (values,), height=_SQUARE)


def run_order_figure(space: Space, treatments: Levels, title: str = "Order of the runs") -> Plot:
    """The level of each axis from run to run, lowest to highest, of treatments (n, axes)."""
    shares = space.checked(treatments) / np.maximum(1, [axis.size - 1 for axis in space.axes])
    names = tuple(axis.name.replace("_", " ") for axis in space.axes)
    colour = PlotAxis("level, from the lowest to the highest", DIMENSIONLESS, limits=(0.0, 1.0))
    rows = PlotAxis("factor", categories=names, reversed=True)
    # a design without runs has no cells, and a heat map of them no columns
    levels = HeatMap(np.asarray(shares.T, dtype=np.float64), colour, detail="levels")
    return Plot(title, PlotAxis("run", DIMENSIONLESS, whole=True), rows, (levels,), height=_FLAT)


def quality_figure(space: Space, designs: Mapping[str, Levels]) -> PlotGrid:
    """Designs by name, treatments (n, axes) in order of run: a column each, on scales that no
    design sets.

    From above: every pair of levels (`pair_matrix`); how far each two effects go together, from 0
    to 1; how far the cells of three axes are from their share, beside runs drawn at random; the
    levels run by run, where long stripes are what is seldom changed. Raises `ValueError` where
    there is no design, a design has no run, or a row is no treatment.
    """
    if not designs:
        raise ValueError("designs is empty; expected at least one to draw")
    for name, treatments in designs.items():
        if not len(space.checked(treatments)):
            raise ValueError(f"design {name!r}: no run; expected at least one")
    columns = [
        (
            pairs_figure(
                level_labels(space), pair_matrix(space, rows), f"{name}: {len(rows)} runs"
            ),
            _effects_figure(space, rows),
            triples_figure(space, rows),
            run_order_figure(space, rows),
        )
        for name, rows in designs.items()
    ]
    return PlotGrid("Quality of the plan", tuple(zip(*columns, strict=True)))


def _effects_figure(space: Space, treatments: Levels) -> Plot:
    """Main effects and interactions of two factors."""
    mains = main_terms(space, treatments)
    terms = [*mains, *interaction_terms(mains)]
    values = term_correlations(terms)
    if len(terms) <= _MOST_NAMES:
        return correlation_figure([term.name for term in terms], values)
    across = PlotAxis(f"effect ({len(mains)} main effects first)", DIMENSIONLESS)
    down = replace(across, reversed=True)
    colour = PlotAxis("correlation of two effects", DIMENSIONLESS, limits=(0.0, 1.0))
    return Plot("Effects", across, down, (HeatMap(values, colour),), height=_SQUARE)


def triples_figure(space: Space, treatments: Levels) -> Plot:
    """Deviations of the cells of three axes, and those of as many runs drawn at random (seed 0)."""
    random_rows = np.random.default_rng(0).integers(
        0, [axis.size for axis in space.axes], treatments.shape
    )
    edges = np.linspace(-_REACH, _REACH, 51)
    series: list[PlotSeries] = []
    for rows, name, role in (
        (treatments, "this plan", ColourRole.CATEGORY_0),
        (random_rows, "runs drawn at random", ColourRole.INK),
    ):
        cells = space.in_strata(rows)
        parts = [
            deviation.ravel()
            for _, deviation in deviations(cells, [axis.strata for axis in space.axes], 3)
        ]
        if parts:
            counts = np.histogram(np.clip(np.concatenate(parts), -_REACH, _REACH), edges)[0]
            filled = rows is treatments
            series.append(
                StepSeries(edges, counts.astype(np.float64), filled, name=name, role=role)
            )
    return Plot(
        "Cells of three factors",
        PlotAxis("runs above the share", DIMENSIONLESS, limits=(-1.05 * _REACH, 1.05 * _REACH)),
        PlotAxis("cells", DIMENSIONLESS, scale="log"),
        tuple(series),
        regions=(ReferenceRegion("x", -1.0, 1.0, "as even as whole runs can be"),),
        height=_FLAT,
    )
