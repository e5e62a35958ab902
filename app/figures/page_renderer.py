"""Any figure as the data that `static/figure.js` draws on a page: plain JSON, where colours are
roles and numbers have as many digits as a screen can show.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import singledispatch
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .figure import (
    BandSeries,
    BarSeries,
    BoxSeries,
    Direction,
    Figure,
    HeatMap,
    LineSeries,
    Plot,
    PlotAxis,
    PlotGrid,
    PlotSeries,
    PointSeries,
    StepSeries,
)

FigureData = dict[str, Any]


def figure_data(figure: Figure) -> FigureData:
    """A figure as JSON; gaps are null.

    Parameters:
        figure: A plot, or plots below each other.

    Returns:
        What `static/charts.js` draws. A grid has its plots as `rows`.

    Raises:
        ValueError: The grid has plots beside each other; a page has a chart for each of them.
    """
    return _plot_data(figure) if isinstance(figure, Plot) else _grid_data(figure)


def _grid_data(grid: PlotGrid) -> FigureData:
    if any(len(row) != 1 for row in grid.rows):
        raise ValueError(
            f"grid {grid.title!r} has rows of {len(grid.rows[0])} plots; a page shows plots below "
            "each other"
        )
    return {
        "title": grid.title,
        "description": grid.description,
        "rows": [_plot_data(plot) for plot in grid.plots()],
        "linked": grid.share_x,
        "legend": list(grid.legend()),
        "notes": list(grid.notes),
    }


def _plot_data(plot: Plot) -> FigureData:
    return {
        "title": plot.title,
        "description": plot.description,
        "x": _axis(plot, "x"),
        "y": _axis(plot, "y"),
        "series": [_common(own) | _numbers(own) for own in plot.series],
        "lines": [_fields(line, _LINE) for line in plot.reference_lines],
        "regions": [_fields(region, _REGION) for region in plot.regions],
        "labels": [_fields(label, _LABEL) for label in plot.labels],
        "legend": list(plot.legend()),
        "notes": list(plot.notes),
        "cursor": plot.cursor,
        "height": plot.height,
        "equal_decades": plot.equal_decades,
    }


def short_numbers(values: ArrayLike, digits: int = 6) -> list[float | None]:
    """Numbers (n,) for JSON, rounded to `digits` significant digits; None where there is none."""
    array = np.asarray(values, dtype=np.float64).ravel()
    finite = np.isfinite(array)
    size = np.abs(np.where(finite & (array != 0), array, 1.0))
    # all at once: a format for each number takes longer than the twin's plate
    places = digits - 1 - np.floor(np.log10(size))
    up, down = 10.0 ** np.clip(places, 0, 300), 10.0 ** np.clip(-places, 0, 300)
    with np.errstate(over="ignore", invalid="ignore"):
        short = np.round(array * up / down) / up * down
    return [
        value if there else None
        for value, there in zip(short.tolist(), finite.tolist(), strict=True)
    ]


_LINE = ("along", "at", "name", "role", "dash", "width")
_REGION = ("along", "start", "stop", "name", "role", "opacity", "mark", "text")
_LABEL = ("text", "x", "y", "anchor", "above", "role")
#: Digits of positions: neighbours of a long record differ in their last ones.
_FINE = 9


def _fields(record: object, names: Sequence[str]) -> FigureData:
    return {name: getattr(record, name) for name in names}


def _axis(plot: Plot, direction: Direction) -> FigureData:
    axis = plot.axis(direction)
    return _axis_words(axis) | {
        "limits": list(plot.limits(direction)),
        "first_view": None if axis.first_view is None else list(axis.first_view),
    }


def _axis_words(axis: PlotAxis) -> FigureData:
    names = ("heading", "unit", "scale", "reversed", "whole", "hidden")
    return _fields(axis, names) | {"categories": list(axis.categories)}


def _common(own: PlotSeries) -> FigureData:
    return _fields(own, ("name", "detail", "role", "opacity", "hidden", "silent"))


def _optional(values: ArrayLike | None) -> list[float | None] | None:
    return None if values is None else short_numbers(values)


@singledispatch
def _numbers(own: PlotSeries) -> FigureData:
    raise TypeError(f"no way to show {type(own).__name__} on a page")


@_numbers.register
def _(own: LineSeries) -> FigureData:
    numbers = {"kind": "line", "x": short_numbers(own.x, _FINE), "y": short_numbers(own.y)}
    return numbers | _fields(own, ("dash", "width", "marks")) | {"labels": list(own.labels)}


@_numbers.register
def _(own: PointSeries) -> FigureData:
    ends = {name: _optional(getattr(own, name)) for name in ("x_low", "x_high", "y_low", "y_high")}
    return {
        "kind": "points",
        "x": short_numbers(own.x, _FINE),
        "y": short_numbers(own.y),
        **ends,
        "size": own.size,
        "filled": own.filled,
        "labels": list(own.labels),
    }


@_numbers.register
def _(own: StepSeries) -> FigureData:
    return {
        "kind": "steps",
        "edges": short_numbers(own.edges, _FINE),
        "values": short_numbers(own.values),
        "filled": own.filled,
    }


@_numbers.register
def _(own: BarSeries) -> FigureData:
    ends = {name: _optional(getattr(own, name)) for name in ("base", "low", "high")}
    return {
        "kind": "bars",
        "position": short_numbers(own.position),
        "end": short_numbers(own.end),
        **ends,
        "width": own.width,
        "horizontal": own.horizontal,
        "labels": list(own.labels),
    }


@_numbers.register
def _(own: BoxSeries) -> FigureData:
    boxes = [
        None
        if box is None
        else short_numbers(
            [
                box.lower_whisker,
                box.lower_quartile,
                box.median,
                box.upper_quartile,
                box.upper_whisker,
            ]
        )
        for box in own.summaries()
    ]
    return {
        "kind": "boxes",
        "position": short_numbers(own.position),
        "boxes": boxes,
        "samples": [short_numbers(values) for values in own.samples],
        "width": own.width,
    }


@_numbers.register
def _(own: BandSeries) -> FigureData:
    return {
        "kind": "band",
        "x": short_numbers(own.x, _FINE),
        "low": short_numbers(own.low),
        "high": short_numbers(own.high),
    }


@_numbers.register
def _(own: HeatMap) -> FigureData:
    return {
        "kind": "heat",
        "values": [short_numbers(row) for row in own.values],
        "palette": own.palette,
        "limits": list(own.colour_limits()),
        "colour": _axis_words(own.colour),
    }
