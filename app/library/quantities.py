"""Quantities as notebooks give them: numbers in SI, text with a unit, or pint's quantities."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pint

    #: What every argument takes that has a unit.
    Quantity = float | str | pint.Quantity[Any]

_NUMBER = re.compile(r"\s*[-+]?(\d+([.,]\d*)?|[.,]\d+)([eE][-+]?\d+)?\s*")


def parse_quantity(text: str, si_unit: str, name: str) -> float:
    """`text` ("5bar", "0,5 kg") in `si_unit`.

    Raises `ValueError` that says `name` for a bare number, an unknown unit or a unit of another dimension.
    """
    from pint.errors import PintError

    from ...signals.units import registry, spelled

    number = _NUMBER.match(text)
    unit = text[number.end() :].strip() if number else ""
    if number is None or not unit:
        raise ValueError(f"{name} is {text!r}; expected a number with a unit, such as 1{si_unit}")
    try:
        scale: Any = registry().Quantity(spelled(unit))
        value = (float(number.group().replace(",", ".")) * scale).to(si_unit).magnitude
    except (PintError, AttributeError, TypeError, ValueError) as error:
        raise ValueError(f"{name} is {text!r}; expected a unit such as {si_unit!r}") from error
    if not math.isfinite(value):
        raise ValueError(f"{name} is {text!r}; expected a finite number")
    return float(value)


def si(value: Quantity, si_unit: str, name: str) -> float:
    """`value` in `si_unit`: a number is taken as it is, text as `parse_quantity` takes it, a pint quantity converted.

    The unit of a pint quantity is read by its name, so quantities of any unit registry will do; its "gram" stays a
    gram. Raises `ValueError` that says `name`, and `TypeError` for what is none of the three.
    """
    if isinstance(value, str):
        return parse_quantity(value, si_unit, name)
    to_unit = getattr(value, "to", None)
    if to_unit is not None:
        from pint.errors import PintError

        try:
            number = float(to_unit(si_unit).magnitude)
        except (PintError, AttributeError, TypeError, ValueError) as error:
            raise ValueError(f"{name} is {value}; expected a unit such as {si_unit!r}") from error
    else:
        try:
            number = float(value)
        except (TypeError, ValueError):
            kinds = f"a number in {si_unit}, text with a unit or a pint quantity"
            raise TypeError(f"{name} is {value!r}; expected {kinds}") from None
    if not math.isfinite(number):
        raise ValueError(f"{name} is {value!r}; expected a finite number")
    return number
