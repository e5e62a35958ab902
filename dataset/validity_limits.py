"""What was recorded of one predictor by itself: two ends, or the levels.

Which settings were recorded together: pairs of levels that never met lie outside, though each was
there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from ..array_types import Floats
from .table import Integers, Predictor

#: A setting within this share of one that was recorded is the same setting.
NEAR = 0.01


def is_near(values: Floats, levels: Sequence[float]) -> NDArray[np.bool_]:
    """Whether each value (n,) is one of the levels."""
    return positions(values, levels) >= 0


def positions(values: Floats, levels: Sequence[float]) -> Integers:
    """The position (n,) of the nearest level; -1 where none is near, or the value is NaN."""
    level_values = np.asarray(levels, dtype=np.float64)
    at = np.abs(values[:, None] - level_values).argmin(axis=1)
    return np.where(np.abs(values - level_values[at]) <= NEAR * np.abs(level_values[at]), at, -1)


def unmet(met: Integers, requested: Integers) -> Integers:
    """Pairs of columns whose levels never met, (m, 3): row of `requested`, and the two columns.

    `met` (k x q) and `requested` (n x q) hold positions of levels; -1 (no level) meets everything.
    """
    unseen = [np.zeros((0, 3), dtype=np.int64)]
    size = 1 + max(met.max(initial=0), requested.max(initial=0))
    for a, b in combinations(range(met.shape[1]), 2):
        is_new = ~np.isin(requested[:, a] * size + requested[:, b], met[:, a] * size + met[:, b])
        rows = np.flatnonzero(is_new & (requested[:, a] >= 0) & (requested[:, b] >= 0))
        unseen.append(np.column_stack([rows, np.full(rows.size, a), np.full(rows.size, b)]))
    return np.concatenate(unseen)


#: A number of so few distinct values was never varied: between two settings, nothing is known.
LEVELS_UP_TO = 2
#: Why such a number lies outside.
BETWEEN_LEVELS = "is none of the values that were recorded"
#: A number of at most so many distinct values, each recorded so many times on average, was set and
#: not measured.
_MOST_LEVELS, _LEAST_REPEATS = 12, 5
_ROUND_OFF = 1e-9


@dataclass(frozen=True)
class OutOfRange:
    """A predictor of one impact that lies outside. `range` is what was recorded: from and to, or
    the levels."""

    predictor: str
    value: float | str
    range: tuple[float, ...] | tuple[str, ...]
    reason: str

    def as_json(self) -> dict[str, Any]:
        """Plain data; a number that is not known is null."""
        value = (
            None if isinstance(self.value, float) and not np.isfinite(self.value) else self.value
        )
        return {
            "predictor": self.predictor,
            "value": value,
            "range": list(self.range),
            "reason": self.reason,
        }

    def __str__(self) -> str:
        """ "impact_velocity = 9 lies beyond what was recorded (0.31 to 2.4)"."""
        value, *ends = (
            bound if isinstance(bound, str) else f"{bound:.4g}"
            for bound in (self.value, *self.range)
        )
        between = ", " if isinstance(self.range[0], str) else " to "
        return f"{self.predictor} = {value} {self.reason} ({between.join(dict.fromkeys(ends))})"


@dataclass(frozen=True)
class Limit:
    """Of one number or category: its distinct `values` where they are levels that others may meet,
    and its ends."""

    predictor: Predictor
    low: float
    high: float
    values: tuple[float, ...] = ()

    @classmethod
    def of(cls, predictor: Predictor, column: Floats) -> Self:
        """Of recorded values (n,), at least one."""
        distinct = np.unique(column)
        was_set = distinct.size <= LEVELS_UP_TO or (
            distinct.size <= _MOST_LEVELS and distinct.size * _LEAST_REPEATS <= column.size
        )
        values = tuple(map(float, distinct)) if predictor.levels or was_set else ()
        return cls(predictor, float(distinct[0]), float(distinct[-1]), values)

    @property
    def range(self) -> tuple[float, ...] | tuple[str, ...]:
        """The recorded levels of a category, else the two ends."""
        if self.predictor.levels:
            return tuple(self.predictor.levels[int(value)] for value in self.values)
        return (self.low, self.high)

    def inside(self, values: Floats) -> NDArray[np.bool_]:
        """Whether each value (n,) was recorded, or lies between what was; NaN never."""
        if self.predictor.levels:
            return np.isin(values, self.values)
        if self._is_level:
            return is_near(values, self.values)
        return ~self.beyond(values) & ~np.isnan(values)

    def beyond(self, values: Floats) -> NDArray[np.bool_]:
        """Whether each number (n,) lies below or above all that were recorded."""
        slack = _ROUND_OFF * max(abs(self.low), abs(self.high))
        return (values < self.low - slack) | (values > self.high + slack)

    def outside(self, value: float) -> OutOfRange:
        """What there is to say of a value that lies outside by itself."""
        return self.telling(value, "is not known" if np.isnan(value) else self._why)

    def telling(self, value: float, reason: str) -> OutOfRange:
        """A value with its reason."""
        return OutOfRange(self.predictor.name, self.shown(value), self.range, reason)

    def shown(self, value: float) -> float | str:
        """A value as a person reads it: a category by its level."""
        levels = self.predictor.levels
        return levels[int(value)] if levels and value in range(len(levels)) else float(value)

    @property
    def _is_level(self) -> bool:
        return 0 < len(self.values) <= LEVELS_UP_TO

    @property
    def _why(self) -> str:
        if self.predictor.levels:
            return "was never recorded"
        return BETWEEN_LEVELS if self._is_level else "lies beyond what was recorded"

    def as_json(self) -> dict[str, Any]:
        """What `from_json` reads back."""
        p = self.predictor
        who = {"name": p.name, "unit": p.unit, "levels": list(p.levels)}
        return {**who, "low": self.low, "high": self.high, "values": list(self.values)}

    @classmethod
    def from_json(cls, data: dict[str, Any]) -> Self:
        """Raises `KeyError`, `TypeError` or `ValueError` for other data."""
        predictor = Predictor(data["name"], data["unit"], tuple(data["levels"]))
        return cls(
            predictor, float(data["low"]), float(data["high"]), tuple(map(float, data["values"]))
        )
