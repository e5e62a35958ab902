"""What a chart shows of rows: their places along the axes, their groups, and the numbers that are
stated beside it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ....array_types import Floats
from ..faults import Fault, RequestError
from .columns import Column, RowGroups, groups_of, one_group
from .control import ControlChart, control_chart
from .correlation import RankCorrelation, rank_correlation
from .distribution import ValueSummary, summary_of
from .request import ChartKind, Exploration, ends_of
from .rows import ORDER, QuantityChoice, SubjectRows, checked_key

#: A quantity with more values is divided into ranges before its levels are drawn.
MOST_LEVELS = 40
#: Half of the width over which the points of a level are spread.
_SPREAD = 0.28
#: Their fractional parts are spread evenly.
_GOLDEN = 0.6180339887498949
#: Quantities along x and y where nobody names any, and the factor whose levels are drawn.
_USUAL = {
    "impacts": ("contact_time_s", "peak_force_n", "campaign"),
    "shots": ("tank_pressure_pa", "measured_velocity_m_s", "campaign"),
    "channels": ("peak_acceleration_m_s2", "srs_peak_frequency_hz", "channel"),
    "models": ("seconds", "force_nrmse", "model"),
}


@dataclass(frozen=True)
class Axes:
    """The keys along x and y, "" for none, and of the colour, None for none."""

    x: str
    y: str
    colour: str | None

    def names(self) -> list[str]:
        """All of them."""
        return [name for name in (self.x, self.y, self.colour) if name]


def axes_of(request: Exploration, choices: Sequence[QuantityChoice]) -> Axes:
    """The quantities that a request names, else the usual ones. Raises `RequestError` for one that
    the rows do not have."""
    usual_x, usual_y, usual_factor = _USUAL[request.subject]

    def key(field: str, name: str | None, usual: str) -> str:
        return usual if name is None else checked_key(field, name, choices)

    colour = None if request.colour is None else checked_key("colour", request.colour, choices)
    x, y = request.x, request.y
    match request.kind:
        case "distribution":
            return Axes(key("x", x, usual_y), "", colour)
        case "levels":
            return Axes(key("x", x, usual_factor), key("y", y, usual_y), colour)
        case "control":
            return Axes(ORDER, key("y", y, usual_y), colour)
    return Axes(key("x", x, usual_x), key("y", y, usual_y), colour)


@dataclass(frozen=True, eq=False)
class ChartData:
    """What is drawn of rows.

    `rows` (m,) are the places of the rows that have all values; `across` and `up` (m,) their
    coordinates in SI, of which a level is its place from 0 on and the order of recording counts
    from 1; a distribution has no `up`. `groups` are by colour. `without_value` rows lack a value,
    `not_positive` ones have no place on a logarithmic axis.
    """

    kind: ChartKind
    x: Column
    y: Column | None
    colour: Column | None
    rows: NDArray[np.intp]
    across: Floats
    up: Floats | None
    groups: RowGroups
    without_value: int
    not_positive: int
    levels: tuple[str, ...] = ()
    summaries: tuple[ValueSummary, ...] = ()
    correlation: RankCorrelation | None = None
    control: ControlChart | None = None
    configurations: int = 0

    def selected(self, request: Exploration) -> NDArray[np.intp]:
        """The rows whose coordinates lie within the selection of a request, ends included."""
        inside = np.ones(self.rows.size, dtype=bool)
        for text, values in ((request.select_x, self.across), (request.select_y, self.up)):
            if text is not None and values is not None:
                low, high = ends_of(text)
                inside &= (values >= low) & (values <= high)
        return self.rows[inside]


def chart_data(request: Exploration, axes: Axes, rows: SubjectRows) -> ChartData:
    """Coordinates, groups and numbers of the rows that can be drawn. Raises `RequestError` for
    words along an axis that needs numbers."""
    x = rows.columns[axes.x]
    y = rows.columns[axes.y] if axes.y else None
    colour = rows.columns[axes.colour] if axes.colour else None
    filled = x.filled() if y is None else x.filled() & _numbers("y", y)[1]
    if request.kind in ("scatter", "distribution"):
        _numbers("x", x)
    positive = _positive(request, x, y)
    drawn = np.flatnonzero(filled & positive)
    if request.kind == "control":
        drawn = rows.order[np.isin(rows.order, drawn)]
    data = ChartData(
        request.kind,
        x,
        y,
        colour,
        drawn,
        np.zeros(0),
        None if y is None or y.numbers is None else y.numbers[drawn],
        one_group(drawn.size) if colour is None else _groups(colour, drawn),
        int(rows.count - np.count_nonzero(filled)),
        int(np.count_nonzero(filled & ~positive)),
        configurations=int(np.unique(rows.configurations[drawn]).size),
    )
    match request.kind:
        case "scatter":
            return _scatter(data, rows)
        case "distribution":
            return _distribution(data)
        case "levels":
            return _levels(data)
    return _control(data)


def _numbers(field: str, column: Column) -> tuple[Floats, NDArray[np.bool_]]:
    numbers = column.numbers
    if numbers is None:
        words = (
            "a quantity, or kind levels, which draws words along x"
            if field == "x"
            else ("a quantity of numbers")
        )
        message = f"{field} is {column.key!r}, whose values are words; expected {words}"
        raise RequestError([Fault(field, message)])
    return numbers, np.isfinite(numbers)


def _positive(request: Exploration, x: Column, y: Column | None) -> NDArray[np.bool_]:
    """Which rows have a place on the axes: a logarithmic one has no zero."""
    positive = np.ones(len(x.values), dtype=bool)
    if request.log_x and request.kind in ("scatter", "distribution") and x.numbers is not None:
        positive &= ~(x.numbers <= 0)
    if request.log_y and y is not None and y.numbers is not None:
        positive &= ~(y.numbers <= 0)
    return positive


def _groups(colour: Column, drawn: NDArray[np.intp]) -> RowGroups:
    return groups_of(Column(colour.key, [colour.values[row] for row in drawn.tolist()]))


def _scatter(data: ChartData, rows: SubjectRows) -> ChartData:
    assert data.x.numbers is not None and data.up is not None
    across = data.x.numbers[data.rows]
    independent = int(np.unique(rows.runs[data.rows]).size)
    correlation = rank_correlation(across, data.up, independent)
    return replace(data, across=across, correlation=correlation)


def _distribution(data: ChartData) -> ChartData:
    assert data.x.numbers is not None
    across = data.x.numbers[data.rows]
    return replace(data, across=across, summaries=_summaries(data.groups, across))


def _levels(data: ChartData) -> ChartData:
    """The levels of x from 0 on, and the points beside each other around them."""
    assert data.up is not None
    x = Column(data.x.key, [data.x.values[row] for row in data.rows.tolist()])
    if len(x.levels) > MOST_LEVELS:
        by_level = groups_of(x)
    else:
        place = {level: number for number, level in enumerate(x.levels)}
        number = np.array([place[value] for value in x.values if value is not None], dtype=np.intp)
        by_level = RowGroups(tuple(map(x.level_name, x.levels)), number)
    share = np.modf(np.arange(1, data.rows.size + 1) * _GOLDEN)[0]
    return replace(
        data,
        across=by_level.number + _SPREAD * (2 * share - 1),
        levels=by_level.names,
        summaries=_summaries(by_level, data.up),
    )


def _control(data: ChartData) -> ChartData:
    assert data.up is not None
    return replace(
        data,
        across=np.arange(1.0, data.rows.size + 1),
        control=control_chart(data.up) if data.up.size > 1 else None,
        summaries=_summaries(data.groups, data.up),
    )


def _summaries(groups: RowGroups, values: Floats) -> tuple[ValueSummary, ...]:
    return tuple(
        summary_of(name, values[groups.number == number])
        for number, name in enumerate(groups.names)
        if np.any(groups.number == number)
    )
