"""What notebooks give and get: quantities (numbers in SI, text with a unit, pint's), DataFrames
whose columns bear their units, which `.attrs["units"]` lists, tables as HTML and progress
bars."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from html import escape
from typing import TYPE_CHECKING, Any

from .progress import Step, notebook_bar
from .unit_endings import unit_ending

if TYPE_CHECKING:
    import pint

    #: What every argument takes that has a unit.
    Quantity = float | str | pint.Quantity[Any]
    import pandas as pd


def unit_of(column: str) -> str:
    """The unit that the end of a column's name says; "" where it says none."""
    name = column.removesuffix("_mean").removesuffix("_lower").removesuffix("_upper")
    entry = unit_ending(name)
    return "" if entry is None else entry.plain


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
    """The frame with these columns alone, in this order. Raises `LookupError` that lists those
    there are."""
    if columns is None:
        return frame
    missing = [column for column in columns if column not in frame.columns]
    if missing:
        there = ", ".join(map(str, frame.columns))
        raise LookupError(f"no column {', '.join(map(repr, missing))}; there are: {there}")
    return with_units(frame[list(columns)])


def sorted_by(frame: pd.DataFrame, sort: str | None) -> pd.DataFrame:
    """Rows by rising values of the column `sort`, by falling ones of "-column"; rows without a
    value last.

    Raises `LookupError` that lists the columns there are.
    """
    if sort is None:
        return frame
    column = sort.removeprefix("-")
    chosen_columns(frame, [column])
    rising = not sort.startswith("-")
    return frame.sort_values(
        column, ascending=rising, kind="stable", na_position="last", ignore_index=True
    )


def titled_table(title: str, frame: pd.DataFrame, rows: int = 12) -> str:
    """HTML of a heading and of the first rows of a frame."""
    shown = frame.head(rows).to_html(border=0, max_cols=16)
    more = f"<p>{len(frame) - rows} further rows: use .to_frame()</p>" if len(frame) > rows else ""
    return f"<p><b>{escape(title)}</b></p>{shown}{more}"


def facts_table(title: str, facts: dict[str, Any]) -> str:
    """HTML of a heading and of names with their values."""
    cells = "".join(
        f"<tr><th>{escape(name)}</th><td>{escape(str(value))}</td></tr>"
        for name, value in facts.items()
    )
    return f"<p><b>{escape(title)}</b></p><table>{cells}</table>"


#: Quotes, brackets, comments and separators: pint's parser, which is Python's, passes over some of
#: them. Marks that turn the direction of writing are not seen.
_NEVER_IN_UNITS = re.compile(
    "[\"'`\\\\#@$;,!?=<>&|~:{}\\[\\]\x00-\x1f\x7f\u200b-\u200f\u2028-\u202e\u2060-\u206f\ufeff]"
)
_NUMBER = re.compile(r"\s*[-+]?(\d+([.,]\d*)?|[.,]\d+)([eE][-+]?\d+)?\s*")
#: SI unit -> units that a bare number may be meant in, each up to the largest number that is
#: plausible in it.
_MEANT: dict[str, tuple[tuple[float, str], ...]] = {
    "Pa": ((100, "bar"), (1e4, "kPa"), (math.inf, "Pa")),
    "kg": ((10, "kg"), (math.inf, "g")),
    "N": ((100, "kN"), (math.inf, "N")),
    "m": ((0.999, "m"), (math.inf, "mm")),
    "s": ((0.099, "s"), (math.inf, "ms")),
    "Hz": ((999, "kHz"), (math.inf, "Hz")),
    "m/s**2": ((math.inf, "g"),),
    "kg/m^3": ((30, "g/cm3"), (math.inf, "kg/m3")),
}
#: Words of a name whose quantity has another size than the others of its unit.
_MEANT_OF_WORD: dict[str, tuple[tuple[float, str], ...]] = {
    "modulus": ((1000, "GPa"), (1e6, "MPa"), (math.inf, "Pa")),
    "strength": ((1e4, "MPa"), (math.inf, "Pa")),
    "timeout": ((math.inf, "s"),),
    "lease": ((math.inf, "s"),),
}


def suggested_unit(number: float, si_unit: str, name: str) -> str:
    """The unit that a bare number of the quantity `name` is most likely meant in: bar for a tank
    pressure of 5."""
    units = next(
        (units for word, units in _MEANT_OF_WORD.items() if word in name), _MEANT.get(si_unit, ())
    )
    return next((unit for largest, unit in units if abs(number) <= largest), si_unit)


def parse_quantity(text: str, si_unit: str, name: str) -> float:
    """`text` ("5bar", "0,5 kg") in `si_unit`.

    Raises `ValueError` that says `name` for a bare number, an unknown unit or a unit of another
    dimension.
    """
    from ...signals.units import usual_factor

    number = _NUMBER.match(text)
    unit = text[number.end() :].strip() if number else ""
    if number is None:
        example = f"1{suggested_unit(1, si_unit, name)}"
        raise ValueError(f"{name} is {text!r}; expected a number with a unit, such as {example}")
    if odd := _NEVER_IN_UNITS.search(unit):
        raise ValueError(
            f"{name} is {text!r:.200}; the unit has the character {odd[0]!r}, which is in no unit"
        )
    if not unit:
        given = text.strip()
        meant = suggested_unit(float(given.replace(",", ".")), si_unit, name)
        raise ValueError(
            f"{name} is {text!r}; expected a number with a unit: did you mean {given}{meant}?"
        )
    value = float(number.group().replace(",", "."))
    factor = usual_factor(unit, si_unit)
    if factor is not None:
        value *= factor
    else:
        value = _by_pint(value, unit, si_unit, text, name)
    if not math.isfinite(value):
        raise ValueError(f"{name} is {text!r}; expected a finite number")
    return value


def _by_pint(number: float, unit: str, si_unit: str, text: str, name: str) -> float:
    """`number` of a unit in `si_unit`, of any unit that pint knows. Raises as `parse_quantity`."""
    from pint.errors import PintError

    from ...signals.units import UnitError, unit_quantity

    try:
        return float((number * unit_quantity(unit)).to(si_unit).magnitude)
    except (PintError, UnitError, ArithmeticError, AttributeError, TypeError, ValueError) as error:
        raise ValueError(
            f"{name} is {text!r:.200}; expected a unit such as {suggested_unit(1, si_unit, name)!r}"
        ) from error


def si(value: Quantity, si_unit: str, name: str) -> float:
    """`value` in `si_unit`: a number is taken as it is, text as `parse_quantity` takes it, a pint
    quantity converted.

    The unit of a pint quantity is read by its name, so quantities of any unit registry will do; its
    "gram" stays a gram. Raises `ValueError` that says `name`, and `TypeError` for what is none of
    the three.
    """
    if isinstance(value, str):
        return parse_quantity(value, si_unit, name)
    to_unit = getattr(value, "to", None)
    if to_unit is not None:
        from pint.errors import PintError

        try:
            number = float(to_unit(si_unit).magnitude)
        except (PintError, AttributeError, TypeError, ValueError) as error:
            unit = suggested_unit(1, si_unit, name)
            raise ValueError(f"{name} is {value}; expected a unit such as {unit!r}") from error
    else:
        try:
            number = float(value)
        except (TypeError, ValueError):
            kinds = f"a number in {si_unit}, text with a unit or a pint quantity"
            raise TypeError(f"{name} is {value!r}; expected {kinds}") from None
    if not math.isfinite(number):
        raise ValueError(f"{name} is {value!r}; expected a finite number")
    return number


@contextmanager
def step_bar(label: str, unit: str, shown: bool) -> Iterator[Step]:
    """A bar that notebooks show, too; where it is not `shown`, nothing is counted."""
    if not shown:
        yield lambda _done, _total, _what: None
        return
    with notebook_bar(label, unit) as step:
        yield step
