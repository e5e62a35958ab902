"""Where a model errs more than it says: its deviations over its spreads, averaged over impacts alike.

A model has one noise level, a bench has not: bare metal on metal scatters more than a tip on an insulator.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from ..estimators.standard import Standard
from ..gp.kernels import squared_distances

#: How far alike reaches, in deviations of the predictors; the last is a mean over all.
REACHES = (0.35, 0.7, 1.4, 2.8, np.inf)


class Difficulty:
    """Deviation over spread as a function of the predictors: the root of the mean of its squares (n,) over the rows x
    (n x d), weighted by exp(-distance^2 / (2 reach^2)) in standardised predictors.

    Far from all rows it is that of the nearest.
    """

    def __init__(self, x: Floats, squares: Floats, reach: float) -> None:
        self.x, self.squares, self.reach = x, squares, reach
        self._columns = Standard.of(x)

    def at(self, x: Floats) -> Floats:
        """Factors (m,) at x (m x d)."""
        distance = squared_distances(self._columns.apply(x), self._columns.apply(self.x))
        distance -= distance.min(axis=1, keepdims=True)
        weight = np.exp(distance / (-2.0 * self.reach**2))
        return np.asarray(np.sqrt((weight @ self.squares) / weight.sum(axis=1)))


def left_out(x: Floats, squares: Floats, folds: Sequence[NDArray[np.bool_]], reach: float) -> Floats:
    """Factors (n,) of each fold's rows from the others."""
    factors = np.empty_like(squares)
    for fold in folds:
        factors[fold] = Difficulty(x[~fold], squares[~fold], reach).at(x[fold])
    return factors


def most_likely(x: Floats, squares: Floats, folds: Sequence[NDArray[np.bool_]]) -> Difficulty:
    """That of the reach which makes the deviations left out most likely, were they normal."""

    def surprise(reach: float) -> float:
        factors = left_out(x, squares, folds, reach)
        return float((np.log(factors) + squares / (2 * factors**2)).sum())

    return Difficulty(x, squares, min(REACHES, key=surprise))
