"""How evenly a design has every pair of levels, as a matrix."""

from __future__ import annotations

import numpy as np

from ...array_types import Floats, Levels
from ..space import Space
from .space_filling import cell_counts


def pair_matrix(space: Space, treatments: Levels) -> Floats:
    """How far each pair of levels is from its share, (levels, levels) of all axes in turn, from -1
    for an empty cell.

    It is the count less its share, over the share (over one run, where the share is smaller), and 0
    where the count is one of the whole numbers beside the share, which no plan can better. The
    blocks on the diagonal show the levels themselves; NaN stands where levels of an axis exclude
    each other. A continuous factor has the parts of its range for levels. Raises `ValueError` for
    rows that are no treatments (n, axes).
    """
    rows, sizes = space.in_strata(treatments), [axis.strata for axis in space.axes]
    starts = np.cumsum([0, *sizes])
    result = np.full((starts[-1], starts[-1]), np.nan)
    for a, _ in enumerate(sizes):
        for b, _ in enumerate(sizes):
            block = result[starts[a] : starts[a + 1], starts[b] : starts[b + 1]]
            counts = cell_counts(rows, sizes, (a, b) if a != b else (a,))
            if a == b:
                np.fill_diagonal(block, _beyond_share(counts))
            else:
                block[:] = _beyond_share(counts)
    return result


def _beyond_share(counts: Levels) -> Floats:
    share = counts.sum() / counts.size
    off = np.where(np.abs(counts - share) < 1, 0.0, counts - share)
    return np.asarray(off / max(1.0, share), dtype=np.float64)


def level_labels(space: Space) -> list[str]:
    """The rows of `pair_matrix`: "tip radius 30 mm", "tip material PLA", "steel/polymeric" of
    several factors."""
    labels = []
    for axis in space.stratified.axes:
        (factor, *others) = axis.factors
        name = "" if others else f"{factor.name.replace('_', ' ')} "
        unit = (
            f" {factor.unit}" if factor.unit and factor.numbers is not None and not others else ""
        )
        labels += [f"{name}{label}{unit}" for label in axis.labels]
    return labels
