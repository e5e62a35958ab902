"""How evenly runs fill the cells of one, two or three axes. Depends on no order of the levels.

Glossary: a cell is a level of each of some axes; its share is the number of runs over the number of such cells.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence

import numpy as np

from ...array_types import Floats, Levels


def cell_counts(treatments: Levels, sizes: Sequence[int], axes: Sequence[int]) -> Levels:
    """Runs in each cell of `axes`, an array with one dimension per axis, of treatments (n, all axes)."""
    shape = tuple(sizes[axis] for axis in axes)
    flat = np.ravel_multi_index(tuple(treatments[:, axis] for axis in axes), shape)
    return np.bincount(flat, minlength=int(np.prod(shape))).reshape(shape)


def deviations(treatments: Levels, sizes: Sequence[int], order: int) -> Iterator[tuple[tuple[int, ...], Floats]]:
    """For every set of `order` axes: the set, and count minus share in each of its cells."""
    for axes in itertools.combinations(range(len(sizes)), order):
        counts = cell_counts(treatments, sizes, axes)
        yield axes, np.asarray(counts - len(treatments) / counts.size, dtype=np.float64)


def worst_deviation(treatments: Levels, sizes: Sequence[int], order: int) -> float:
    """The largest distance of a cell's count from its share, in runs; 0 where there are too few axes."""
    return max((float(np.abs(deviation).max()) for _, deviation in deviations(treatments, sizes, order)), default=0.0)


def rms_deviation(treatments: Levels, sizes: Sequence[int], order: int) -> float:
    """Root mean square of count minus share over the cells of all sets of axes; 0 where there are too few axes."""
    parts = [deviation.ravel() for _, deviation in deviations(treatments, sizes, order)]
    return float(np.sqrt(np.mean(np.concatenate(parts) ** 2))) if parts else 0.0


def beyond_one(treatments: Levels, sizes: Sequence[int], order: int) -> int:
    """Cells whose count is a whole run or more from its share: 0 is as even as whole runs can be."""
    return sum(int((np.abs(deviation) > 1 - 1e-9).sum()) for _, deviation in deviations(treatments, sizes, order))


def distinct(treatments: Levels) -> int:
    """Number of different treatments among (n, axes)."""
    return len(np.unique(treatments, axis=0))
