"""`--where "tip_material=steel"`: words of a listing's filter into conditions in SI."""

from __future__ import annotations

import re

from ...schema.conditions import CAMPAIGN
from ...schema.known_factors import BY_COLUMN, level_label
from ...schema.listings import OPERATORS, Condition

_FORM = re.compile(r"\s*(?P<field>[^=<>!]+?)\s*(?P<operator><=|>=|!=|=|<|>)\s*(?P<value>.*?)\s*$")


def parse_where(words: tuple[str, ...]) -> tuple[Condition, ...]:
    """Conditions from `field=value` (also != < <= > >=). Raises `ValueError` with the form that is expected.

    A field may be a listing's key (`tip_radius_m`), or the column of `runs.csv` with its unit (`tip_radius_mm`).
    """
    return tuple(_condition(word) for word in words)


def _condition(word: str) -> Condition:
    match = _FORM.match(word)
    if match is None or not match["value"]:
        signs = " ".join(OPERATORS)
        raise ValueError(f"--where {word!r} is not a condition; expected FIELD=VALUE (or one of {signs})")
    field, operator, text = match["field"], match["operator"], match["value"]
    factor = BY_COLUMN.get(field)
    value: str | float = text
    number = None if field == CAMPAIGN else _number(text)  # a campaign's name may look like one
    if number is not None:
        value = number
    if factor is not None:
        field = factor.name
        if number is not None and factor.si_unit is not None:
            value = float(level_label(number * factor.scale))
    if operator not in ("=", "!=") and number is None:
        raise ValueError(f"--where {word!r} compares with {text!r}; expected a number after {operator}")
    return Condition(field, operator, value if isinstance(value, float) else text)


def _number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None
