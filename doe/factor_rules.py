"""Rules over factors as a person reads them: "insulator = polymeric and tank_pressure_bar >
1.2"."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, pairwise

import numpy as np
from numpy.typing import NDArray

from ..schema.known_factors import column_of

#: A level: a text, or a number in SI.
Level = str | float

_AND, _SIGN = " and ", "(?:=|!=|>|<=)"


@dataclass(frozen=True, eq=False)
class SettingRule:
    """`inside` (C,) are the settings that it holds for.

    `same`: rules of one condition on other factors that hold for the same settings. `columns`: the
    factors of all of these, as the campaign's files name them.
    """

    text: str
    conditions: int
    inside: NDArray[np.bool_]
    columns: frozenset[str]
    same: tuple[str, ...] = ()


def rules(settings: Sequence[Mapping[str, Level]], least: int = 2) -> tuple[SettingRule, ...]:
    """All rules of one or two conditions that split the settings (levels by factor), with at least
    so many on both sides.

    Rules that hold for the same settings are one: the first, and simplest, stands for them, and
    names those on other factors.
    """
    names = dict.fromkeys(name for setting in settings for name in setting)
    single = [rule for name in names for rule in _conditions(name, settings)]
    pairs = [
        SettingRule(
            f"{first.text}{_AND}{second.text}",
            2,
            first.inside & second.inside,
            first.columns | second.columns,
        )
        for first, second in combinations(single, 2)
    ]
    distinct: dict[bytes, SettingRule] = {}
    for rule in [*single, *pairs]:
        size, key = int(rule.inside.sum()), rule.inside.tobytes()
        if least <= size <= len(settings) - least:
            first = distinct.setdefault(key, rule)
            if rule.conditions == 1 and not rule.columns <= first.columns:
                same, columns = (*first.same, rule.text), first.columns | rule.columns
                distinct[key] = replace(first, same=same, columns=columns)
    return tuple(distinct.values())


def holds(text: str, setting: Mapping[str, Level]) -> bool:
    """Whether a setting (levels in SI by the factors' names in the store) lies in the region of a
    rule.

    Raises `ValueError` for a text that is no rule, `LookupError` for a factor that the setting does
    not have.
    """
    named = {column_of(name)[0]: (value, column_of(name)[1]) for name, value in setting.items()}
    # A level may hold the word "and": only before a column and its sign does it join two
    # conditions.
    columns = "|".join(map(re.escape, named))
    return all(
        _holds(condition, named)
        for condition in re.split(f"{_AND}(?=(?:{columns}) {_SIGN} )", text)
    )


def _holds(condition: str, named: Mapping[str, tuple[Level, float]]) -> bool:
    match = re.fullmatch(f"(.+?) ({_SIGN}) (.*)", condition, re.DOTALL)
    if match is None:
        raise ValueError(
            f"{condition!r} is no rule: expected 'factor = level' or 'factor > number'"
        )
    column, sign, level = match.groups()
    if column not in named:
        raise LookupError(f"no factor {column!r}; there are: {', '.join(named)}")
    value, unit = named[column]
    if sign in ("=", "!="):
        return (_word(value, unit) == level) == (sign == "=")
    return (float(value) / unit > float(level)) == (sign == ">")


def _conditions(name: str, settings: Sequence[Mapping[str, Level]]) -> list[SettingRule]:
    """Rules of one condition on a factor: thresholds where all its values are numbers, else
    levels."""
    values = [setting.get(name) for setting in settings]
    column, unit = column_of(name)
    if all(isinstance(value, int | float) for value in values):
        numbers = np.array(values, dtype=np.float64)
        thresholds = [
            short_between(low / unit, high / unit) for low, high in pairwise(np.unique(numbers))
        ]
        above = [(f"{number:.12g}", numbers / unit > number) for number in thresholds]
        texts = [
            (f"{column} {sign} {number}", part == (sign == ">"))
            for number, part in above
            for sign in (">", "<=")
        ]
    else:
        words = np.array(["" if value is None else _word(value, unit) for value in values])
        levels = [word for word in dict.fromkeys(words.tolist()) if word]
        texts = [(f"{column} = {level}", words == level) for level in levels]
        texts += [(f"{column} != {level}", words != level) for level in levels if len(levels) > 2]
    return [SettingRule(text, 1, inside, frozenset({column})) for text, inside in texts]


def _word(value: Level, unit: float) -> str:
    """A number with the digits in which levels of the store differ."""
    return value if isinstance(value, str) else f"{value / unit:.12g}"


def short_between(low: float, high: float) -> float:
    """The number of fewest digits that is at least `low` and below `high`, near their middle."""
    middle = 0.5 * (low + high)
    for digits in range(1, 15):
        number = float(f"{middle:.{digits}g}")
        if low <= number < high and abs(number - middle) <= 0.25 * (high - low):
            return number
    return low
