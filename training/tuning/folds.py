"""Folds of cross-validation that never part a configuration."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray


def grouped_folds(groups: NDArray[Any], folds: int, rng: np.random.Generator) -> list[NDArray[np.bool_]]:
    """Which rows (n,) each fold leaves out; every group is left out once. No more folds than there are groups.

    Groups are dealt out at random, as many to each fold. Raises `ValueError` for a single group: nothing can be left
    out of it.
    """
    names, group = np.unique(groups, return_inverse=True)
    if len(names) < 2 or folds < 2:
        raise ValueError(f"{len(names)} configurations cannot make {folds} folds: there must be two of each at least")
    fold = rng.permutation(np.arange(len(names)) % min(folds, len(names)))[group]
    return [fold == one for one in range(min(folds, len(names)))]
