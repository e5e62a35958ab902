"""DataFrames of rows from the store: columns bear their units, and `.attrs["units"]` lists them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pandas as pd

#: End of a column's name -> unit, the longer ends first: "_m_s2" also ends with "_s2".
_UNITS = {
    "_m_s2": "m/s2",
    "_kg_m3": "kg/m3",
    "_kg_s": "kg/s",
    "_m_s": "m/s",
    "_n_s": "N s",
    "_n_m": "N/m",
    "_mb": "MB",
    "_hz": "Hz",
    "_pa": "Pa",
    "_kg": "kg",
    "_m3": "m3",
    "_m2": "m2",
    "_mm": "mm",
    "_nm": "N m",
    "_db": "dB",
    "_n": "N",
    "_j": "J",
    "_k": "K",
    "_v": "V",
    "_m": "m",
    "_s": "s",
}


def unit_of(column: str) -> str:
    """The unit that the end of a column's name says; "" where it says none."""
    name = column.removesuffix("_mean").removesuffix("_lower").removesuffix("_upper")
    return next((unit for end, unit in _UNITS.items() if name.endswith(end) and name != end[1:]), "")


def with_units(frame: pd.DataFrame) -> pd.DataFrame:
    """The same frame, with `.attrs["units"]`: column -> unit, of the columns that have one."""
    named = {str(column): unit_of(str(column)) for column in frame.columns}
    frame.attrs["units"] = {column: unit for column, unit in named.items() if unit}
    return frame


def frame_of(rows: Iterable[Mapping[str, Any]], columns: Sequence[str] = ()) -> pd.DataFrame:
    """A frame of rows by column; `columns` are those of a frame without rows."""
    import pandas as pd

    listed = list(rows)
    return with_units(pd.DataFrame(listed) if listed else pd.DataFrame(columns=list(columns)))


def chosen_columns(frame: pd.DataFrame, columns: Sequence[str] | None) -> pd.DataFrame:
    """The frame with these columns alone, in this order. Raises `LookupError` that lists those there are."""
    if columns is None:
        return frame
    missing = [column for column in columns if column not in frame.columns]
    if missing:
        there = ", ".join(map(str, frame.columns))
        raise LookupError(f"no column {', '.join(map(repr, missing))}; there are: {there}")
    return with_units(frame[list(columns)])


def sorted_by(frame: pd.DataFrame, sort: str | None) -> pd.DataFrame:
    """Rows by rising values of the column `sort`, by falling ones of "-column"; rows without a value last.

    Raises `LookupError` that lists the columns there are.
    """
    if sort is None:
        return frame
    column = sort.removeprefix("-")
    chosen_columns(frame, [column])
    rising = not sort.startswith("-")
    return frame.sort_values(column, ascending=rising, kind="stable", na_position="last", ignore_index=True)
