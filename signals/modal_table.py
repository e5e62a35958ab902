"""The columns of a modal table, a mode a row: `plate_modes.csv` of a campaign, or the table of a
bench."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence

from ..files.delimited_text import Line, parse_number

SHAPE = "shape_"
#: What is expected of a column, and its range: from the first number to below the second.
_EXPECTED = {
    "mode": ("a whole number", 0.0, 2.0**31),
    "frequency_hz": ("a frequency of zero or more", 0.0, math.inf),
    "damping_ratio": ("a ratio from 0 to below 1", 0.0, 1.0),
}
_ANY = ("a finite number", -math.inf, math.inf)


def modal_columns(
    header: Sequence[str], lines: Sequence[Line], required: Collection[str] = ()
) -> dict[str, list[float]]:
    """Numbers of `mode`, `frequency_hz`, `damping_ratio` and each `shape_...`, by column; other
    columns have no say.

    Raises `ValueError` for a `required` column that is missing, a mode that stands twice, and with
    row, column, value and what was expected for a cell.
    """
    for column in required:
        if column not in header:
            raise ValueError(f"no column {column!r}; there are: {', '.join(header)}")
    if not lines:
        raise ValueError("no modes below the header; expected at least one row")
    names = [name for name in header if name in _EXPECTED or name.startswith(SHAPE)]
    rows = [[_number(line, name, cells[name]) for name in names] for line, cells in lines]
    columns = {
        name: list(values) for name, values in zip(names, zip(*rows, strict=True), strict=True)
    }
    modes = columns.get("mode", [])
    if repeated := [mode for mode in modes if modes.count(mode) > 1]:
        raise ValueError(f"mode {repeated[0]:.0f} stands twice")
    return columns


def _number(line: int, column: str, text: str) -> float:
    expected, low, high = _EXPECTED.get(column, _ANY)
    try:
        value = parse_number(text)
    except ValueError:
        value = math.nan
    if not low <= value < high or (column == "mode" and not value.is_integer()):
        raise ValueError(f"row {line}, column {column!r}: {text!r}; expected {expected}")
    return value
