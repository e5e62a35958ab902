"""Rules over factors as a person reads them: "insulator = polymeric and tank_pressure_bar > 1.2"."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise

import numpy as np
from numpy.typing import NDArray

from ...schema.columns import BY_NAME
from ..record import Configuration, Factor

_AND = " and "


@dataclass(frozen=True, eq=False)
class Rule:
    """`inside` (C,) are the configurations that it holds for."""

    text: str
    conditions: int
    inside: NDArray[np.bool_]


def column_of(factor: str) -> tuple[str, float]:
    """A factor as the campaign's files name it, and its unit in SI: ("tank_pressure_bar", 1e5)."""
    known = BY_NAME.get(factor)
    return (known.column, known.scale) if known else (factor, 1.0)


def rules(configurations: Sequence[Configuration], least: int = 2) -> tuple[Rule, ...]:
    """All rules of one or two conditions that split the configurations, with at least so many on both sides.

    Rules that hold for the same configurations are one: the first, and simplest, stands for them.
    """
    single = _conditions(configurations)
    found: dict[bytes, Rule] = {}
    for rule in [*single, *(_both(a, b) for a, b in combinations(single, 2))]:
        size = int(rule.inside.sum())
        if least <= size <= len(configurations) - least:
            found.setdefault(rule.inside.tobytes(), rule)
    return tuple(found.values())


def holds(text: str, factors: Mapping[str, Factor]) -> bool:
    """Whether a configuration with these factors (SI, by their names in the store) lies in the region of a rule.

    Raises `ValueError` for a text that is no rule, `LookupError` for a factor that the configuration does not have.
    """
    return all(_holds(condition, factors) for condition in text.split(_AND))


def _holds(condition: str, factors: Mapping[str, Factor]) -> bool:
    try:
        column, sign, level = condition.split(" ", 2)
    except ValueError:
        raise ValueError(f"{condition!r} is no rule: expected 'factor = level' or 'factor > number'") from None
    named = {column_of(name)[0]: (value, column_of(name)[1]) for name, value in factors.items()}
    if column not in named:
        raise LookupError(f"no factor {column!r}; there are: {', '.join(named)}")
    value, unit = named[column]
    if sign in ("=", "!="):
        return (_word(value, unit) == level) == (sign == "=")
    return (float(value) / unit > float(level)) == (sign == ">")


def _conditions(configurations: Sequence[Configuration]) -> list[Rule]:
    names = dict.fromkeys(name for each in configurations for name in each.factors)
    found: list[Rule] = []
    for name in names:
        values = [each.factors.get(name) for each in configurations]
        if all(isinstance(value, int | float) for value in values):
            found += _thresholds(name, np.array(values, dtype=np.float64))
        else:
            found += _levels(name, values)
    return found


def _thresholds(name: str, values: NDArray[np.float64]) -> list[Rule]:
    column, unit = column_of(name)
    levels = np.unique(values)
    found = []
    for low, high in pairwise(levels):
        number = short_between(low / unit, high / unit)
        above = values / unit > number
        found += [Rule(f"{column} > {number:g}", 1, above), Rule(f"{column} <= {number:g}", 1, ~above)]
    return found


def _levels(name: str, values: Sequence[Factor | None]) -> list[Rule]:
    column, unit = column_of(name)
    words = np.array(["" if value is None else _word(value, unit) for value in values])
    levels = [word for word in dict.fromkeys(words.tolist()) if word]
    found = [Rule(f"{column} = {level}", 1, words == level) for level in levels]
    return found + [Rule(f"{column} != {level}", 1, words != level) for level in levels if len(levels) > 2]


def _word(value: Factor, unit: float) -> str:
    return value if isinstance(value, str) else f"{value / unit:g}"


def _both(one: Rule, other: Rule) -> Rule:
    return Rule(f"{one.text}{_AND}{other.text}", 2, one.inside & other.inside)


def short_between(low: float, high: float) -> float:
    """The number of fewest digits that is at least `low` and below `high`, near their middle."""
    middle = 0.5 * (low + high)
    for digits in range(1, 15):
        number = float(f"{middle:.{digits}g}")
        if low <= number < high and abs(number - middle) <= 0.25 * (high - low):
            return number
    return low
