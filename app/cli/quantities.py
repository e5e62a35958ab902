"""Quantities on the command line carry a unit: `5bar`, `0.5kg`, `45mm`."""

from __future__ import annotations

import math
import re
from typing import Any

_NUMBER = re.compile(r"\s*[-+]?(\d+([.,]\d*)?|[.,]\d+)([eE][-+]?\d+)?\s*")


def parse_quantity(text: str, si_unit: str, name: str) -> float:
    """`text` in `si_unit`. A bare number, an unknown unit or another dimension is refused by `ValueError`."""
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
