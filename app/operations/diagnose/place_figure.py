"""Where the error of the nominal model lies, as one figure on one scale of colours: families of
observables, stretches of time and bands of frequency, stage by stage, over the levels of the
factors."""

from __future__ import annotations

import math

import numpy as np

from ....diagnosis.verdict import Verdict
from ....diagnosis.what_if import MapColumn, MapRow
from ....schema.known_factors import BY_NAME
from ...common.number_format import number
from ...common.quantities import display_of
from ...figures.figure import ColourRole, HeatMap, Plot, PlotAxis

#: Colours reach from the tolerance to so many tolerances at least.
_LEAST_END = 10.0
#: Px of a row, of what stands above and below, and of the whole at least: names of columns may
#: take four tenths of it.
_ROW, _AXES, _LEAST_HEIGHT = 15, 190, 320
#: More rows and columns cannot be read on a screen: the families come first, and are all there.
_MOST_ROWS, _MOST_COLUMNS = 30, 28


def place_plot(verdict: Verdict) -> Plot | None:
    """The figure; None where the diagnosis does not hold it."""
    own = verdict.error_map
    if own is None or not own.rows:
        return None
    rows, columns = own.rows[:_MOST_ROWS], own.columns[:_MOST_COLUMNS]
    values = np.array([np.asarray(row)[: len(columns)] for row in own.values[: len(rows)]])
    largest = float(np.nanmax(values)) if np.isfinite(values).any() else 1.0
    return Plot(
        "Where the error lies",
        PlotAxis("", categories=_different([column_words(column) for column in columns])),
        PlotAxis("", categories=_different([row_words(row) for row in rows]), reversed=True),
        (
            HeatMap(
                values=values,
                colour=PlotAxis(
                    "rms error in tolerances",
                    "1",
                    "log",
                    limits=(1.0, max(_LEAST_END, largest)),
                ),
                detail="error",
                role=ColourRole.BEFORE,
            ),
        ),
        height=max(_AXES + _ROW * len(rows), _LEAST_HEIGHT),
    )


def _different(names: list[str]) -> tuple[str, ...]:
    """Names of categories, numbered where two are the same."""
    return tuple(
        name if names.count(name) == 1 else f"{name} ({names[: i + 1].count(name)})"
        for i, name in enumerate(names)
    )


def row_words(row: MapRow) -> str:
    """`gun: velocity`, `force 0.1 to 0.4 ms`, `acceleration 160 to 260 Hz`."""
    if row.low is None or row.high is None:
        return f"{row.stage}: {row.name}"
    unit, scale = ("ms", 1e3) if row.kind == "time" else ("Hz", 1.0)
    low, high = (_two_digits(scale * end) for end in (row.low, row.high))
    if low == high:
        return f"{row.name} {low} {unit}"
    return f"{row.name} {low} to {high} {unit}"


def _two_digits(value: float) -> str:
    return number(float(f"{value:.2g}"))


def column_words(column: MapColumn) -> str:
    """`all runs`, `steel: tip material`, `0.3 to 0.6 bar: tank pressure`; the level first, since a
    narrow axis cuts the ends of its names."""
    if not column.factor:
        return "all runs"
    name = column.factor.replace("_", " ")
    if column.low is None or column.high is None:
        return f"{column.level}: {name}"
    factor = BY_NAME.get(column.factor)
    unit, scale = "", 1.0
    if factor:
        display = display_of(factor.column)
        unit, scale = display.unit, display.scale / factor.scale
    low, high = number(scale * column.low), number(scale * column.high)
    numbers = low if math.isclose(column.low, column.high) else f"{low} to {high}"
    return f"{f'{numbers} {unit}'.rstrip()}: {name}"
