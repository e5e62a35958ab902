"""The figure of a dataset: how its predictors hang together (thesis, Fig. 4.8), and which values
they took."""

from __future__ import annotations

import numpy as np

from ....array_types import Floats
from ....dataset.predictors import correlation
from ....dataset.table import Predictor, PulseTable
from ...common.quantities import shown_unit
from ...figures.figure import (
    DIMENSIONLESS,
    BarSeries,
    ColourRole,
    HeatMap,
    Plot,
    PlotAxis,
    PlotGrid,
    StepSeries,
    TextLabel,
)

_BINS = 24
#: Heights in px of a page.
_SQUARE, _FLAT = 560.0, 150.0


def dataset_figure(table: PulseTable) -> PlotGrid:
    """The correlation matrix above the histogram of each predictor."""
    values = [
        _values_plot(predictor, column)
        for predictor, column in zip(table.predictors, table.x.T, strict=True)
    ]
    return PlotGrid("Predictors", tuple((plot,) for plot in (correlation_plot(table), *values)))


def correlation_plot(table: PulseTable) -> Plot:
    """The matrix with its numbers; predictors that never varied have none."""
    coefficients = correlation(table)
    labels = tuple(
        TextLabel(
            "-" if np.isnan(value) else f"{round(float(value), 2) + 0.0:.2f}",
            float(j),
            float(i),
            role=ColourRole.INK,
        )
        for (i, j), value in np.ndenumerate(coefficients.matrix)
    )
    colour = PlotAxis("correlation", "-", limits=(-1.0, 1.0))
    names = tuple(coefficients.names)
    return Plot(
        f"Correlation of the predictors, {len(table)} pulses",
        PlotAxis("", categories=names),
        PlotAxis("", categories=names, reversed=True),
        (HeatMap(coefficients.matrix, colour, "diverging"),),
        labels=labels,
        height=_SQUARE,
    )


def _values_plot(predictor: Predictor, column: Floats) -> Plot:
    pulses = PlotAxis("pulses", DIMENSIONLESS, from_zero=True, whole=True)
    if predictor.levels:
        places = np.arange(len(predictor.levels), dtype=np.float64)
        counts = np.array([(column == place).sum() for place in places], dtype=np.float64)
        levels = PlotAxis(predictor.name, categories=tuple(predictor.levels))
        return Plot(
            predictor.name, levels, pulses, (BarSeries(places, counts, width=0.5),), height=_FLAT
        )
    unit, scale = shown_unit(predictor.unit or "")
    counts, edges = np.histogram(scale * column, _BINS)
    steps = StepSeries(edges, counts.astype(np.float64), filled=True)
    axis = PlotAxis(predictor.name, unit or DIMENSIONLESS)
    return Plot(predictor.name, axis, pulses, (steps,), height=_FLAT)
