"""How many runs each level gets, and runs that have exactly that: the start of an exchange, and its repair."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...array_types import Floats, Ids
from .pydoe import unit_lhs


def level_counts(already: Floats, capacity: Ids, n: int, rng: np.random.Generator) -> Ids:
    """`n` runs shared out among levels, (levels,), so that with `already` (levels,) they are as even as can be.

    No level gets more than its `capacity` (levels,), which must hold `n` in all. Chance decides who gets the rest.
    """
    if capacity.sum() < n:
        raise ValueError(f"capacity is {capacity.tolist()}, {int(capacity.sum())} in all; expected at least n = {n}")
    counts, turn = np.zeros(len(already), dtype=np.int64), rng.permutation(len(already)) / (2 * len(already))
    for _ in range(n):
        height = np.where(counts < capacity, already + counts + turn, np.inf)
        counts[height.argmin()] += 1
    return counts


def cut_hypercube(counts: Sequence[Ids], n: int, rng: np.random.Generator) -> Ids:
    """Runs (n, axes) with `counts` (levels,) of each axis: a Latin hypercube's ranks, cut where the levels end."""
    unit = unit_lhs(n, len(counts), rng)
    ranks = unit.argsort(axis=0).argsort(axis=0)
    columns = [
        np.repeat(np.arange(len(level_counts)), level_counts)[ranks[:, axis]]
        for axis, level_counts in enumerate(counts)
    ]
    return np.stack(columns, axis=1)


def repaired(found: Ids, pool: Ids, levels: Ids, counts: Sequence[Ids]) -> Ids:
    """Different treatments of the pool, (n,): as found (n,), but for those that are not; `levels` (size, axes).

    In their place come those of the pool whose levels are missing most.
    """
    kept = np.intersect1d(found, pool)
    for _ in range(len(found) - len(kept)):
        free = np.setdiff1d(pool, kept)
        missing = [
            (level_counts - np.bincount(levels[kept, axis], minlength=len(level_counts)))[levels[free, axis]]
            for axis, level_counts in enumerate(counts)
        ]
        kept = np.append(kept, free[np.minimum(missing, 1).sum(axis=0).argmax()])
    return np.asarray(kept)
