"""The charts of an exploration: scatter, distribution, levels, and control chart."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ....array_types import Floats
from ...common.number_format import format_number
from ...common.quantities import display_of
from ...figures.figure import (
    DIMENSIONLESS,
    BarSeries,
    ColourRole,
    LineSeries,
    Plot,
    PlotAxis,
    PlotGrid,
    PlotSeries,
    PointSeries,
    ReferenceLine,
    StepSeries,
    category,
)
from .chart import ChartData
from .columns import NO_VALUE, Column, RowGroups
from .control import BEYOND, ONE_SIDE, RANGE_BEYOND
from .distribution import histogram_edges
from .rows import SubjectRows
from .thinning import MOST_POINTS, thin_line, thin_outliers, thin_scatter

#: From low to high: blue over grey to orange, which colour-blind readers tell apart.
_RISING = (
    ColourRole.CATEGORY_0,
    ColourRole.CATEGORY_5,
    ColourRole.CATEGORY_7,
    ColourRole.CATEGORY_6,
    ColourRole.CATEGORY_1,
)
#: Marks of a cell: from which part of the fullest cell on, diameter in px, opacity.
_CELL_MARKS = ((0.0, 4.0, 0.3), (1 / 64, 6.0, 0.5), (1 / 16, 8.0, 0.7), (1 / 4, 10.0, 1.0))
#: Diameters in px of points, and of rings about them; of more than these they are smaller.
_POINT_PX, _SMALL_POINT_PX, _RING_PX, _SMALL_RING_PX = 5.0, 3.0, 12.0, 7.0
_MANY = 600
#: Points of a line in order, and rings of each rule: a page has no room for more.
_MOST_OF_LINE = 2_000
#: Bars of boxes, as parts of the distance between levels.
_BOX = 0.64


@dataclass(frozen=True, eq=False)
class DrawnChart:
    """The plots of a chart, from above, and how much of the rows they show one by one: `points`
    rows, and the others within `cells`, 0 where nothing is drawn together."""

    plots: tuple[Plot, ...]
    points: int
    cells: int = 0

    def figure(self) -> Plot | PlotGrid:
        """All of it in one figure."""
        if len(self.plots) == 1:
            return self.plots[0]
        return PlotGrid(
            "Control chart of individuals", tuple((plot,) for plot in self.plots), share_x=True
        )


def draw(data: ChartData, rows: SubjectRows, *, log_x: bool, log_y: bool) -> DrawnChart:
    """The chart of some rows; `log_x` and `log_y` ask for logarithmic axes."""
    match data.kind:
        case "scatter":
            return _scatter(data, rows, log_x, log_y)
        case "distribution":
            return _distribution(data, log_x)
        case "levels":
            return _levels(data, rows, log_y)
    return _control(data, rows, log_y)


def _axis(column: Column, *, logarithmic: bool = False) -> PlotAxis:
    display = display_of(column.key)
    return PlotAxis(
        display.label, display.unit or DIMENSIONLESS, "log" if logarithmic else "linear"
    )


def _role(groups: RowGroups, number: int) -> ColourRole:
    if groups.names[number] == NO_VALUE:
        return ColourRole.QUIET
    if groups.ordered:
        named = len(groups.names) - (NO_VALUE in groups.names)
        return _RISING[round(number * (len(_RISING) - 1) / max(1, named - 1))]
    return category(number)


def _points(
    data: ChartData,
    rows: SubjectRows,
    places: NDArray[np.intp],
    scales: tuple[float, float],
) -> list[PlotSeries]:
    """Points of some of the drawn rows by group, each with the name of its row."""
    assert data.up is not None
    series: list[PlotSeries] = []
    for number, name in enumerate(data.groups.names):
        own = places[data.groups.number[places] == number]
        if own.size:
            labels = tuple(rows.label(row) for row in data.rows[own].tolist())
            series.append(
                PointSeries(
                    data.across[own] * scales[0],
                    data.up[own] * scales[1],
                    size=_POINT_PX if places.size <= _MANY else _SMALL_POINT_PX,
                    labels=labels,
                    name=name,
                    detail="" if name else "row",
                    role=_role(data.groups, number),
                    opacity=0.8,
                )
            )
    return series


def _scatter(data: ChartData, rows: SubjectRows, log_x: bool, log_y: bool) -> DrawnChart:
    assert data.y is not None and data.up is not None
    scales = data.x.scale, data.y.scale
    scaled_x = np.log10(data.across) if log_x else data.across
    scaled_y = np.log10(data.up) if log_y else data.up
    thinned = thin_scatter(scaled_x, scaled_y, data.groups.number)
    cells = thinned.cells
    x = (10.0**cells.x if log_x else cells.x) * scales[0]
    y = (10.0**cells.y if log_y else cells.y) * scales[1]
    series: list[PlotSeries] = []
    share = cells.count / max(1, cells.count.max(initial=1))
    kind_of_mark = np.searchsorted([start for start, *_ in _CELL_MARKS], share, "right") - 1
    for kind, (_, size, opacity) in enumerate(_CELL_MARKS):
        of_size = kind_of_mark == kind
        for number, name in enumerate(data.groups.names):
            own = of_size & (cells.group == number)
            if own.any():
                labels = tuple(f"{count} rows about here" for count in cells.count[own].tolist())
                series.append(
                    PointSeries(
                        x[own],
                        y[own],
                        size=size,
                        labels=labels,
                        name=name,
                        detail="" if name else "rows",
                        role=_role(data.groups, number),
                        opacity=opacity,
                    )
                )
    series += _points(data, rows, thinned.points, scales)
    notes: tuple[str, ...] = ()
    if cells.count.size:
        notes = (
            "Pale to full marks stand for few to many rows. Single rows and extremes are points.",
        )
    title = f"{data.y.heading} over {data.x.heading}"
    x_axis, y_axis = _axis(data.x, logarithmic=log_x), _axis(data.y, logarithmic=log_y)
    plot = Plot(title, x_axis, y_axis, _by_legend(series, data.groups), notes=notes)
    return DrawnChart((plot,), thinned.points.size, cells.count.size)


def _by_legend(series: Sequence[PlotSeries], groups: RowGroups) -> tuple[PlotSeries, ...]:
    """In the order of the groups, which is that of the legend; cells before points."""
    return tuple(sorted(series, key=lambda own: groups.names.index(own.name)))


def _distribution(data: ChartData, log_x: bool) -> DrawnChart:
    scale = data.x.scale
    series: list[PlotSeries] = []
    lines: list[ReferenceLine] = []
    if data.across.size:
        edges = histogram_edges(data.across, logarithmic=log_x)
        several = len(data.groups.names) > 1
        for number, name in enumerate(data.groups.names):
            own = data.across[data.groups.number == number]
            counts, _ = np.histogram(own, edges)
            series.append(
                StepSeries(
                    edges * scale,
                    counts.astype(float),
                    filled=not several,
                    name=name,
                    detail=name or "rows",
                    role=_role(data.groups, number),
                )
            )
        if not several:
            summary = data.summaries[0]
            lines = [
                ReferenceLine("x", summary.q05 * scale, "5 %", ColourRole.QUIET, "dot"),
                ReferenceLine("x", summary.median * scale, "median", ColourRole.INK),
                ReferenceLine("x", summary.q95 * scale, "95 %", ColourRole.QUIET, "dot"),
            ]
    plot = Plot(
        f"Distribution of {data.x.heading}",
        _axis(data.x, logarithmic=log_x),
        PlotAxis("rows", DIMENSIONLESS, from_zero=True, whole=True),
        tuple(series),
        tuple(lines),
        cursor="column",
    )
    return DrawnChart((plot,), data.across.size)


def _levels(data: ChartData, rows: SubjectRows, log_y: bool) -> DrawnChart:
    assert data.y is not None and data.up is not None
    scale = data.y.scale
    level = np.rint(data.across).astype(np.intp)
    boxes = [_box(data.up[level == number]) for number in range(len(data.levels))]
    series: list[PlotSeries] = []
    places = np.arange(data.rows.size)
    notes: tuple[str, ...] = ()
    if data.rows.size > MOST_POINTS:
        ends = np.array([(box[0], box[4]) for box in boxes])
        outside = np.flatnonzero((data.up < ends[level, 0]) | (data.up > ends[level, 1]))
        places = outside[thin_outliers(data.up[outside])]
        notes = (
            f"Of {outside.size} rows beyond the whiskers {places.size} are drawn"
            + (", those that lie furthest out." if places.size < outside.size else "."),
        )
    if boxes:
        low, first, median, third, high = (
            np.array([box[part] for box in boxes]) * scale for part in range(5)
        )
        position = np.arange(len(boxes), dtype=float)
        counts = np.bincount(level, minlength=len(boxes)).tolist()
        labels = tuple(f"{count} rows, middle half" for count in counts)
        series.append(
            BarSeries(
                position, third, first, low, high, _BOX, labels=labels,
                detail="box", role=ColourRole.NOISE, opacity=0.5,
            )
        )  # fmt: skip
        gaps = np.full(len(boxes), np.nan)
        ends_of_line = [position - _BOX / 2, position + _BOX / 2, gaps]
        series.append(
            LineSeries(
                np.stack(ends_of_line, axis=1).ravel(),
                np.stack([median, median, gaps], axis=1).ravel(),
                detail="median",
                role=ColourRole.INK,
            )
        )
    series += _points(data, rows, places, (1.0, scale))
    x_axis = PlotAxis(display_of(data.x.key).label, categories=data.levels or ("no level",))
    title = f"{data.y.heading} by {display_of(data.x.key).label}"
    plot = Plot(title, x_axis, _axis(data.y, logarithmic=log_y), tuple(series), notes=notes)
    return DrawnChart((plot,), places.size)


def _box(values: Floats) -> tuple[float, float, float, float, float]:
    """Whiskers to the last values within 1.5 quartile ranges, quartiles and median (Tukey)."""
    first, median, third = (float(value) for value in np.quantile(values, [0.25, 0.5, 0.75]))
    reach = 1.5 * (third - first)
    inside = values[(values >= first - reach) & (values <= third + reach)]
    return float(inside.min()), first, median, third, float(inside.max())


def _control(data: ChartData, rows: SubjectRows, log_y: bool) -> DrawnChart:
    assert data.y is not None and data.up is not None
    scale = data.y.scale
    ends = (0.0, data.rows.size + 1.0)
    x_axis = PlotAxis("order of recording", DIMENSIONLESS, limits=ends, whole=True)
    y_axis = _axis(data.y, logarithmic=log_y)
    title = f"Control chart of {data.y.heading}"
    chart = data.control
    if chart is None:
        series = tuple(_points(data, rows, np.arange(data.rows.size), (1.0, scale)))
        return DrawnChart((Plot(title, x_axis, y_axis, series),), data.rows.size)
    drawn = thin_line(chart.values, _MOST_OF_LINE)
    broken = thin_outliers(chart.values[chart.beyond], _MOST_OF_LINE)
    marked = [
        (chart.beyond[broken], BEYOND, ColourRole.CATEGORY_1),
        (_spread(chart.one_side), ONE_SIDE, ColourRole.CATEGORY_3),
    ]
    line = LineSeries(
        data.across[drawn], chart.values[drawn] * scale, width=1.0,
        detail="values in order", role=ColourRole.QUIET, silent=True,
    )  # fmt: skip
    upper = Plot(
        title,
        x_axis,
        y_axis,
        (line, *_points(data, rows, drawn, (1.0, scale)), *_rings(data, rows, marked, scale)),
        _limits((("centre", chart.centre), ("limit", chart.lower), ("limit", chart.upper)), scale,
                positive=log_y),
    )  # fmt: skip
    ranges = thin_line(chart.moving_range, _MOST_OF_LINE)
    beyond = chart.range_beyond - 1
    beyond = beyond[thin_outliers(chart.moving_range[beyond], _MOST_OF_LINE)]
    display = display_of(data.y.key)
    lower = Plot(
        f"Moving range of {data.y.heading}",
        x_axis,
        PlotAxis("moving range", display.unit or DIMENSIONLESS, from_zero=True),
        (
            LineSeries(
                data.across[ranges + 1],
                chart.moving_range[ranges] * scale,
                width=1.0,
                marks=ranges.size <= _MANY,
                detail="moving range",
                role=ColourRole.CATEGORY_0,
            ),
            *_range_rings(data, rows, beyond, scale),
        ),
        _limits((("centre", chart.mean_range), ("limit", chart.range_limit)), scale),
    )
    return DrawnChart((upper, lower), int(np.union1d(drawn, chart.beyond[broken]).size))


def _spread(places: NDArray[np.intp]) -> NDArray[np.intp]:
    """Places (k,), evenly taken where they are more than can be drawn."""
    if places.size <= _MOST_OF_LINE:
        return places
    return places[np.linspace(0, places.size - 1, _MOST_OF_LINE).astype(np.intp)]


def _rings(
    data: ChartData,
    rows: SubjectRows,
    marked: Sequence[tuple[NDArray[np.intp], str, ColourRole]],
    scale: float,
) -> list[PlotSeries]:
    """Rings about points that break a rule, with the names of their rows."""
    assert data.up is not None
    return [
        PointSeries(
            data.across[places],
            data.up[places] * scale,
            size=_RING_PX if places.size <= _MANY else _SMALL_RING_PX,
            filled=False,
            labels=tuple(rows.label(row) for row in data.rows[places].tolist()),
            name=rule,
            role=role,
        )
        for places, rule, role in marked
        if places.size
    ]


def _range_rings(
    data: ChartData, rows: SubjectRows, places: NDArray[np.intp], scale: float
) -> list[PlotSeries]:
    assert data.control is not None
    if not places.size:
        return []
    return [
        PointSeries(
            data.across[places + 1],
            data.control.moving_range[places] * scale,
            size=_RING_PX if places.size <= _MANY else _SMALL_RING_PX,
            filled=False,
            labels=tuple(rows.label(row) for row in data.rows[places + 1].tolist()),
            name=RANGE_BEYOND,
            role=ColourRole.CATEGORY_1,
        )
    ]


def _limits(
    named: Sequence[tuple[str, float]], scale: float, *, positive: bool = False
) -> tuple[ReferenceLine, ...]:
    """Centre lines and limits with their values; of a logarithmic axis those that it has."""
    return tuple(
        ReferenceLine(
            "y",
            value * scale,
            f"{name} {format_number(value * scale)}",
            ColourRole.INK if name == "centre" else ColourRole.CATEGORY_1,
            "solid" if name == "centre" else "dash",
        )
        for name, value in named
        if value > 0 or not positive
    )
