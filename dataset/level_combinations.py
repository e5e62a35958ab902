"""Which settings were recorded together: pairs of levels that never met lie outside, though each was there."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from ..array_types import Floats
from .table import Integers

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


def unmet(met: Integers, asked: Integers) -> Integers:
    """Pairs of columns whose levels never met, (m, 3): row of `asked`, and the two columns.

    `met` (k x q) and `asked` (n x q) hold positions of levels; -1 (no level) meets everything.
    """
    unseen = [np.zeros((0, 3), dtype=np.int64)]
    size = 1 + max(met.max(initial=0), asked.max(initial=0))
    for a, b in combinations(range(met.shape[1]), 2):
        is_new = ~np.isin(asked[:, a] * size + asked[:, b], met[:, a] * size + met[:, b])
        rows = np.flatnonzero(is_new & (asked[:, a] >= 0) & (asked[:, b] >= 0))
        unseen.append(np.column_stack([rows, np.full(rows.size, a), np.full(rows.size, b)]))
    return np.concatenate(unseen)
