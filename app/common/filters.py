"""`--where "tip_material=steel"`: words of a listing's filter into conditions in SI."""

from __future__ import annotations

import re

from ...schema.conditions import CAMPAIGN, IMPACT_COLUMNS, SHOT_COLUMNS, ConditionError
from ...schema.known_factors import BY_COLUMN, BY_NAME, level_label
from ...schema.listings import OPERATORS, Condition
from .frames import parse_quantity
from .quantities import key_of, si_unit_of

#: What no store can look for: zero bytes, and halves of surrogate pairs.
_UNWRITABLE = re.compile("[\x00\ud800-\udfff]")
_FORM = re.compile(r"\s*(?P<field>[^=<>!]+?)\s*(?P<operator><=|>=|!=|=|<|>)\s*(?P<value>.*?)\s*$")


def parse_where(words: tuple[str, ...]) -> tuple[Condition, ...]:
    """Conditions from `field=value` (also != < <= > >=). Raises `ConditionError` with the form that
    is expected.

    A field may be a listing's key (`tip_radius_m`), or the column of `runs.csv` with its unit
    (`tip_radius_mm`): a bare number is in that unit. It may be the words of a heading (`peak
    force`), whose numbers need a unit (`1kN`).
    """
    try:
        return tuple(_condition(word) for word in words)
    except ConditionError:
        raise
    except ValueError as error:
        raise ConditionError(str(error)) from error


def _condition(word: str) -> Condition:
    unwritable = _UNWRITABLE.search(word)
    if unwritable is not None:
        raise ConditionError(
            f"--where {word!r:.200} has the character {unwritable[0]!r}, "
            f"which is in no name; leave it out"
        )
    match = _FORM.match(word)
    if match is None or not match["value"]:
        signs = " ".join(OPERATORS)
        raise ConditionError(
            f"--where {word!r:.200} is not a condition; expected FIELD=VALUE (or one of {signs})"
        )
    field, operator, text = match["field"], match["operator"], match["value"]
    factor = BY_COLUMN.get(field)
    if factor is None and (condition := _with_unit(field, operator, text)) is not None:
        return condition
    value: str | float = text
    number = None if field == CAMPAIGN else _number(text)  # a campaign's name may look like one
    if number is not None:
        value = number
    if factor is not None:
        field = factor.name
        if number is not None and factor.si_unit is not None:
            value = float(level_label(number * factor.scale))
    if operator not in ("=", "!=") and number is None:
        raise ConditionError(
            f"--where {word!r:.200} compares with {text!r:.200}; expected a number after {operator}"
        )
    return Condition(field, operator, value if isinstance(value, float) else text)


#: Keys of listings that have a unit; their words name them, too.
_KEYS = tuple(key for key in IMPACT_COLUMNS | SHOT_COLUMNS if si_unit_of(key))


def _with_unit(field: str, operator: str, text: str) -> Condition | None:
    """A quantity with its unit; None where the field names none, or its key says in which unit a
    bare number is.

    Raises `ValueError` for a bare number of a field without a unit in its name.
    """
    words = field.partition("(")[0].strip().replace(" ", "_")
    factor = BY_NAME.get(words)
    if factor is not None and factor.si_unit is not None:
        number = parse_quantity(text, factor.si_unit, f"--where {field}")
        return Condition(words, operator, float(level_label(number)))
    key = key_of(field, _KEYS)
    unit = si_unit_of(key).replace("m/s²", "m/s**2")
    if not unit or (key == field and (_number(text) is not None or not text[:1].isdigit())):
        return None
    return Condition(
        key, operator, float(level_label(parse_quantity(text, unit, f"--where {field}")))
    )


def _number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None
