"""Columns of rows as a chart takes them: numbers in SI with gaps, or words; and groups of rows by
the values of a column."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ....array_types import Floats
from ...common.number_format import format_number
from ...common.quantities import display_of, heading, level_words

Value = float | int | str | None
#: Colours that are told apart: more words than these go together as the others, and a quantity with
#: more values than these is divided into ranges.
MOST_GROUPS, RANGES = 8, 5
NO_VALUE, OTHERS = "no value", "others"


@dataclass(frozen=True, eq=False)
class Column:
    """The values (n) of a column, None where a row has none."""

    key: str
    values: Sequence[Value]

    @cached_property
    def numbers(self) -> Floats | None:
        """The numbers (n,) in SI, NaN for None; None of a column that has words."""
        if str in set(map(type, self.values)):  # also of words that read as numbers
            return None
        return np.array(self.values, dtype=np.float64)

    @property
    def heading(self) -> str:
        """The words of its quantity, with the unit."""
        return heading(self.key)

    @property
    def scale(self) -> float:
        """Shown value = `scale` times the value."""
        return display_of(self.key).scale

    def filled(self) -> NDArray[np.bool_]:
        """Which rows (n,) have a value."""
        if self.numbers is not None:
            return np.isfinite(self.numbers)
        return np.array([value is not None for value in self.values], dtype=bool)

    @cached_property
    def levels(self) -> list[float | int | str]:
        """The different values, numbers before words."""
        present = {value for value in self.values if value is not None}
        return sorted(present, key=lambda value: (isinstance(value, str), value))

    def level_name(self, level: Value) -> str:
        """A value as a level of a factor."""
        return level_words(self.key, float(level) if isinstance(level, int) else level)


@dataclass(frozen=True, eq=False)
class RowGroups:
    """Rows by group: the `names` of the groups, and the number of each row's group (n,). `ordered`
    groups are ranges of numbers that rise."""

    names: tuple[str, ...]
    number: NDArray[np.intp]
    ordered: bool = False


def one_group(count: int) -> RowGroups:
    """All rows together."""
    return RowGroups(("",), np.zeros(count, dtype=np.intp))


def groups_of(column: Column) -> RowGroups:
    """Rows by the values of a column: by the value where there are few, else by ranges of equally
    many rows, or the most frequent words and all others. Rows without a value are a group of their
    own."""
    levels = column.levels
    if len(levels) <= MOST_GROUPS:
        names = [column.level_name(level) for level in levels]
        place: dict[Value, int] = {level: number for number, level in enumerate(levels)}
        return _with_missing(names, [place.get(value, -1) for value in column.values])
    if column.numbers is not None:
        return _ranges(column, column.numbers)
    counts = Counter(value for value in column.values if value is not None)
    frequent = [level for level, _ in counts.most_common(MOST_GROUPS - 1)]
    place = {level: number for number, level in enumerate(frequent)}
    numbers = [-1 if value is None else place.get(value, len(frequent)) for value in column.values]
    return _with_missing([*map(column.level_name, frequent), OTHERS], numbers)


def _ranges(column: Column, numbers: Floats) -> RowGroups:
    finite = numbers[np.isfinite(numbers)]
    inner = np.unique(np.quantile(finite, np.linspace(0, 1, RANGES + 1)[1:-1]))
    number = np.searchsorted(inner, numbers, "right")
    number[~np.isfinite(numbers)] = -1
    display = display_of(column.key)
    ends = [float(finite.min()), *inner.tolist(), float(finite.max())]
    shown = [format_number(end * display.scale, 3) for end in ends]
    names = [f"{low} to {high} {display.unit}".rstrip() for low, high in pairwise(shown)]
    return _with_missing(names, number.tolist(), ordered=True)


def _with_missing(
    names: Sequence[str], numbers: Sequence[int], *, ordered: bool = False
) -> RowGroups:
    number = np.array(numbers, dtype=np.intp)
    missing = number < 0
    if missing.any():
        names = [*names, NO_VALUE]
        number[missing] = len(names) - 1
    return RowGroups(tuple(names), number, ordered)
