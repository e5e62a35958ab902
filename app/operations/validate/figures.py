"""Figures of a validation: what the bands of the twin hold, and measured over predicted values."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ...common.quantities import shown_unit
from ...figures.figure import (
    DIMENSIONLESS,
    BarSeries,
    LineSeries,
    Plot,
    PlotAxis,
    PlotSeries,
    PointSeries,
    ReferenceLine,
    as_floats,
    category,
    equal_line,
    side_by_side,
)
from .verdict import joint_interval, quantity_words

_FREQUENCY = PlotAxis("frequency", "Hz", scale="log")


def coverage_figure(data: Mapping[str, Any]) -> Plot:
    """Shares inside of the 50 and the 90 % bands by quantity, with 95 % intervals and the nominal
    shares."""
    quantities = data["quantities"]
    bars, nominal = [], []
    for i, (band, role) in enumerate(((50, category(1)), (90, category(0)))):
        shares = 100 * as_floats([row[f"coverage{band}"] for row in quantities])
        intervals = [_interval(row, band, len(quantities)) for row in quantities]
        ends = as_floats(intervals).reshape(-1, 2)
        low, high = 100 * np.clip(ends.T, 0.0, 1.0)
        offset, width = side_by_side(2, i)
        bars.append(
            BarSeries(
                offset + np.arange(len(quantities), dtype=np.float64),
                shares,
                low=np.minimum(low, shares),
                high=np.maximum(high, shares),
                width=width,
                name=f"inside of the {band} % band",
                role=role,
            )
        )
        nominal.append(ReferenceLine("y", band, role=role, width=1.5))
    names = tuple(quantity_words(row["name"]) for row in quantities)
    return Plot(
        "Coverage of the bands",
        PlotAxis("quantity", DIMENSIONLESS, categories=names),
        PlotAxis("measured values inside", "%", limits=(0.0, 103.0)),
        tuple(bars),
        tuple(nominal),
    )


def _interval(row: Mapping[str, Any], band: int, quantities: int) -> tuple[float, float]:
    """Of the 90 % band the interval that the verdict rests on."""
    return joint_interval(row, quantities) if band == 90 else tuple(row[f"coverage{band}_ci95"])


def rank_figure(data: Mapping[str, Any]) -> Plot:
    """Probability-integral histograms: the share of measured values by their rank among the
    draws."""
    series = []
    for i, row in enumerate(data["quantities"]):
        shares = as_floats(row["pit_histogram"])
        middle = (np.arange(len(shares)) + 0.5) / len(shares)
        name = quantity_words(row["name"])
        series.append(LineSeries(middle, shares, marks=True, name=name, role=category(i)))
    return Plot(
        "Ranks of the measured values",
        PlotAxis("rank among the predicted draws", DIMENSIONLESS, limits=(0.0, 1.0)),
        PlotAxis("share of measured values", DIMENSIONLESS, from_zero=True),
        tuple(series),
        (ReferenceLine("y", 0.1, "bands that mean what they say"),),
    )


def comparison_figures(data: Mapping[str, Any]) -> dict[str, Plot]:
    """Measured over predicted values with their 90 % bands, by quantity: first those whose bands
    hold the smallest shares."""
    figures = {}
    for row in sorted(data["quantities"], key=lambda row: row["coverage90"]):
        shots = [
            shot["quantities"][row["name"]]
            for shot in data["shots"]
            if row["name"] in shot["quantities"]
        ]
        if not shots:
            continue
        unit, scale = shown_unit(row["quantity_unit"])
        measured, predicted, low, high = (
            scale * as_floats([shot[key] for shot in shots])
            for key in ("measured", "predicted", "low90", "high90")
        )
        words = quantity_words(row["name"])
        points = PointSeries(
            measured, predicted, y_low=low, y_high=high, name="prediction with its 90 % band"
        )
        x, y = (
            PlotAxis(f"{side} {words}", unit or DIMENSIONLESS, scale="log")
            for side in ("measured", "predicted")
        )
        series = (equal_line("equal", measured, low, high), points)
        figures[words] = Plot(f"Predicted over measured {words}", x, y, series)
    return figures


def line_figures(data: Mapping[str, Any]) -> dict[str, Plot]:
    """Coverage of the 90 % band and median error at each line of the spectra."""
    if not data["lines"]:
        return {}
    inside: list[PlotSeries] = []
    error: list[PlotSeries] = []
    for i, (name, rows) in enumerate(data["lines"].items()):
        frequency = as_floats([row["frequency_hz"] for row in rows])
        words, role = quantity_words(name), category(i)
        shares = 100 * as_floats([row["coverage90"] for row in rows])
        median = as_floats([row["median_abs_error"] for row in rows])
        inside.append(LineSeries(frequency, shares, name=words, role=role))
        error.append(LineSeries(frequency, median, name=words, role=role))
    plots = (
        Plot(
            "Inside of the 90 % band",
            _FREQUENCY,
            PlotAxis("measured values inside", "%"),
            tuple(inside),
            (ReferenceLine("y", 90.0, "90 %"),),
        ),
        Plot("Median error of the level", _FREQUENCY, PlotAxis("error", "dB"), tuple(error)),
    )
    return {plot.title: plot for plot in plots}
