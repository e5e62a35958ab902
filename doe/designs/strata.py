"""Values of continuous factors within the parts of their ranges that a balanced design gives to its runs."""

from __future__ import annotations

import numpy as np

from ...array_types import Ids
from ..merit.ranks import centres
from ..merit.space_filling import discrepancy
from ..space import Axis, Space

#: Ways to share out the values that are drawn, of which the most even is kept.
_DRAWS = 20


def valued(space: Space, strata: Ids, recorded: Ids, rng: np.random.Generator) -> Ids:
    """Treatments (n, axes) of the space from those of `space.stratified`, beside the `recorded` (k, axes) ones.

    The runs in one part of a range have values at equal distances in it, so that the whole column is a Latin hypercube
    as far as the factor's steps are fine enough. Which run gets which value is the best of several draws: fewest
    repeated treatments first, then the least centred discrepancy.
    """
    drawn = [_drawn(space, strata, rng) for _ in range(_DRAWS)]
    return min(drawn, key=lambda rows: _unevenness(space, np.vstack([recorded, rows])))


def _unevenness(space: Space, rows: Ids) -> tuple[int, float]:
    return len(rows) - len(np.unique(rows, axis=0)), discrepancy(centres(space, rows), "CD")


def _drawn(space: Space, strata: Ids, rng: np.random.Generator) -> Ids:
    rows = strata.copy()
    for index, axis in enumerate(space.axes):
        if axis.continuous:
            for stratum in range(axis.strata):
                members = np.flatnonzero(strata[:, index] == stratum)
                rows[members, index] = rng.permutation(_values(axis, stratum, len(members)))
    return rows


def _values(axis: Axis, stratum: int, count: int) -> Ids:
    """(count,): indices of values at equal distances in a part of a range."""
    first, after = (-(-edge * axis.size // axis.strata) for edge in (stratum, stratum + 1))
    return first + np.floor((np.arange(count) + 0.5) / max(count, 1) * (after - first)).astype(np.int64)
