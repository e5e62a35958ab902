"""A factors file with ranges in place of levels, as the command line's `--range` and the Python API write them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from ..schema.known_factors import BY_COLUMN, BY_NAME
from ..schema.toml_text import toml_table
from .factors import number_label

_PRESSURE, _VELOCITY_LEVEL = "tank_pressure", "velocity_level"


def with_ranges(text: str, ranges: Mapping[str, Sequence[float]]) -> str:
    """The factors file with continuous factors: column (or name) to low, high and, if wished, step, in the column's
    unit.

    A factor of the file keeps its place and its work to change; a column that only recordings know, such as
    "tank_pressure_bar", is added. A tank pressure takes the place of the velocity levels, which it would contradict.
    Raises `ValueError` for any other column, for words, and for a range that is none; comments of the text are lost.
    """
    if not ranges:
        return text
    import tomli_w

    table = toml_table(text)
    factors = table.get("factors", [])
    if not isinstance(factors, list):
        raise ValueError(f"factors is {factors!r}; expected tables [[factors]]")
    for column, limits in ranges.items():
        factors = _with_range(factors, column, limits)
    return tomli_w.dumps({**table, "factors": factors})


def _with_range(factors: list[dict[str, Any]], column: str, limits: Sequence[float]) -> list[dict[str, Any]]:
    if not 2 <= len(limits) <= 3:
        raise ValueError(f"range of {column} is {list(limits)}; expected low and high, or low, high and step")
    numbers = dict(zip(("low", "high", "step"), (float(number_label(float(limit))) for limit in limits), strict=False))
    for index, factor in enumerate(factors):
        if column in (factor.get("column", factor.get("name")), factor.get("name")):
            if "unit" not in factor or factor.get("kind") == "ordered":
                raise ValueError(f"{column} has words for levels; expected a factor of numbers for a range")
            kept = {key: factor[key] for key in ("name", "column", "unit", "change") if key in factor}
            return [*factors[:index], {**kept, "kind": "continuous", **numbers}, *factors[index + 1 :]]
    known_factor = BY_COLUMN.get(column) or BY_NAME.get(column)
    if known_factor is None or not known_factor.is_number:
        there = ", ".join(str(factor.get("column", factor.get("name"))) for factor in factors)
        raise ValueError(f"no factor {column!r} to give a range; there: {there}")
    unit = known_factor.column.removeprefix(f"{known_factor.name}_")
    added = {"name": known_factor.name, "column": known_factor.column, "kind": "continuous", "unit": unit, **numbers}
    replaced = _VELOCITY_LEVEL if known_factor.name == _PRESSURE else None
    return [*(factor for factor in factors if factor.get("name") != replaced), added]
