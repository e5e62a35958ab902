"""How often the bench is rebuilt when runs follow each other, factor by factor."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .space import Axis, Space


def factor_levels(axis: Axis) -> NDArray[np.int64]:
    """(combinations, factors): the level of each factor of an axis."""
    return np.array(axis.combinations, dtype=np.int64).reshape(axis.size, len(axis.factors))


def changeovers(space: Space, treatments: NDArray[np.int64]) -> dict[str, int]:
    """Factor to the number of times that it differs from the run before, treatments (n, axes) in order of run."""
    changes_by_factor: dict[str, int] = {}
    for index, axis in enumerate(space.axes):
        changed = np.diff(factor_levels(axis)[treatments[:, index]], axis=0) != 0
        changes_by_factor |= {factor.name: int(changed[:, place].sum()) for place, factor in enumerate(axis.factors)}
    return {factor.name: changes_by_factor[factor.name] for factor in space.factors}
