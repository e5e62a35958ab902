"""Values as a person types them into a form or behind a command: numbers with their units, and
outlines of plates."""

from __future__ import annotations

import re
from typing import Any

from ...files.delimited_text import parse_number
from ...signals.units import USUAL_FACTORS, UnitError, unit_quantity

_MEASURE = re.compile(r"([-+]?[\d.,]+(?:[eE][-+]?\d+)?)\s*([^\d\s].*)?")


def number_of(text: str, unit: str) -> float | str:
    """A number as a person types it, in SI: "0.01", "0,01", or "10 mm" where the unit is m.

    Parameters:
        text: What was typed.
        unit: The SI unit of the number; "" of a pure number.

    Returns:
        The number in `unit`; the text itself where it is none, which the ingest then refuses.
    """
    match = _MEASURE.fullmatch(text.strip())
    if match is None:
        return text
    try:
        number = parse_number(match[1])
    except ValueError:  # the ingest refuses the text with its place
        return text
    stated = (match[2] or "").strip()
    if not stated or stated == unit:
        return number
    # a `g` of a mass is a gram, which is no `g` of an acceleration
    if usual := USUAL_FACTORS.get(unit, {}).get(stated):
        return float(f"{number * usual:.12g}")
    try:
        factor = unit_quantity(stated).to(unit_quantity(unit.replace("³", "**3")).units).magnitude
    # what pint raises for a text that is no unit, or one of another dimension
    except (UnitError, ArithmeticError, AttributeError, TypeError, ValueError):
        return text
    return float(f"{number * float(factor):.12g}")


def outline_of(text: str) -> Any:
    """Corners of a plate: `0.6 x 0.4` is a rectangle, `0, 0; 0.6, 0; 0.6, 0.4` are corners; in m,
    or with a unit behind each number of a rectangle.

    Parameters:
        text: What was typed.

    Returns:
        The corners [[x, y], …] in m; the text itself where it is none.
    """
    sides = [number_of(part, "m") for part in re.split(r"\s*[x×]\s*", text)]
    if len(sides) == 2 and all(isinstance(side, float) for side in sides):
        a, b = sides
        return [[0.0, 0.0], [a, 0.0], [a, b], [0.0, b]]
    corners = []
    for corner in text.split(";"):
        parts = re.split(r"\s*,\s*|\s+", corner.strip())
        try:
            x, y = (float(part) for part in parts)
        except ValueError:  # the ingest refuses the text with its place
            return text
        corners.append([x, y])
    return corners


def plain_text(value: Any) -> str:
    """A value of TOML as a control holds it: 0.01, 12 for 12.0.

    Parameters:
        value: A text or a number; None is no text.
    """
    if value is None:
        return ""
    if isinstance(value, float) and value.is_integer() and abs(value) < 1e15:
        return str(int(value))
    return str(value)
