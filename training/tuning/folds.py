"""Folds of cross-validation that never part a configuration."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray


def grouped_folds(
    groups: NDArray[Any], folds: int, rng: np.random.Generator
) -> list[NDArray[np.bool_]]:
    """Which rows (n,) each fold of scikit-learn's `GroupKFold` leaves out; no more folds than there
    are groups.

    Groups are dealt out at random, as many to each fold. Raises `ValueError` for a single group:
    nothing can be left out of it.
    """
    from sklearn.model_selection import GroupKFold

    names = np.unique(groups)
    if len(names) < 2 or folds < 2:
        raise ValueError(
            f"{len(names)} configurations cannot make {folds} folds: there "
            f"must be two of each at least"
        )
    splitter = GroupKFold(
        min(folds, len(names)), shuffle=True, random_state=int(rng.integers(2**31))
    )
    rows = np.arange(len(groups))
    return [np.isin(rows, left_out) for _, left_out in splitter.split(groups, groups=groups)]
