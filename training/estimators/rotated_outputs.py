"""Outputs turned until their noise is independent, for regressions that take it to be."""

from __future__ import annotations

import copy
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from .base import Arrays, Estimator, FitReport, Gaussian, require_fitted


class RotatedOutputs(Estimator):
    """Another regression, of combinations of the outputs (n x m) that scatter independently among
    repetitions.

    One blow too hard lifts all points of a pulse. A process whose outputs have noise of their own
    each can explain that by short lengthscales only, and follows it. Here repetitions tell the
    noise's covariance: what is left in each group, where it has rows enough, after a line in the
    predictors that vary there. Its eigenvectors (of outputs over their deviation) are the new
    outputs. Without repetitions nothing is turned.

    The spread is turned back as if the regression's own outputs were independent.
    """

    kind = "turned"

    def __init__(self, inner: Estimator) -> None:
        self.inner = inner

    inner_: Estimator | None = None
    #: m x m: new outputs are old ones times `turn_`.
    turn_: Floats

    def settings(self) -> dict[str, Any]:
        return {"inner": {"kind": self.inner.kind, "settings": self.inner.settings()}}

    def fit(self, x: Floats, y: Floats, groups: NDArray[Any], rng: np.random.Generator) -> Self:
        self.turn_ = _rotation(x, y, groups)
        self.inner_ = copy.deepcopy(self.inner).fit(x, y @ self.turn_, groups, rng)
        return self

    def refit(self, x: Floats, y: Floats, groups: NDArray[Any], rng: np.random.Generator) -> Self:
        new, inner = type(self)(self.inner), self._learned()
        new.turn_ = self.turn_
        new.inner_ = inner.refit(x, y @ self.turn_, groups, rng)
        return new

    def relearn(self, x: Floats, y: Floats, groups: NDArray[Any], rng: np.random.Generator) -> Self:
        new = type(self)(self.inner)
        new.turn_ = _rotation(x, y, groups)
        new.inner_ = self._learned().relearn(x, y @ new.turn_, groups, rng)
        return new

    def predict(self, x: Floats) -> Gaussian:
        turned = self._learned().predict(x)
        back = np.linalg.inv(self.turn_)
        spread = None if turned.spread is None else np.sqrt(turned.spread**2 @ back**2)
        return Gaussian(turned.mean @ back, spread)

    def fit_report(self) -> FitReport:
        return self._learned().fit_report()

    def _learned(self) -> Estimator:
        return require_fitted(self.inner_, self.kind)

    def arrays(self) -> Arrays:
        inner = self._learned().arrays()
        return {"turn": self.turn_, **{f"inner.{name}": array for name, array in inner.items()}}

    def restore(self, arrays: Arrays) -> Self:
        turn = arrays.get("turn")
        if turn is None or turn.ndim != 2 or turn.shape[0] != turn.shape[1]:
            raise ValueError(
                f"{self.kind!r} is restored from a square array 'turn', which is missing"
            )
        self.turn_ = turn
        inner = {name[6:]: array for name, array in arrays.items() if name.startswith("inner.")}
        self.inner_ = copy.deepcopy(self.inner).restore(inner)
        return self


def _rotation(x: Floats, y: Floats, groups: NDArray[Any]) -> Floats:
    deviation = y.std(axis=0)
    scale = 1.0 / np.where(deviation > 0, deviation, 1.0)
    noise = repetition_covariance(x, y * scale, groups)
    if noise is None:
        return np.diag(scale)
    vectors = np.linalg.eigh(noise)[1]
    vectors *= np.where(vectors.sum(axis=0) < 0, -1.0, 1.0)
    return np.asarray(scale[:, None] * vectors)


def repetition_covariance(x: Floats, y: Floats, groups: NDArray[Any]) -> Floats | None:
    """Covariance m x m of y (n x m) within groups, after a line in those columns of x (n x d) that
    vary in the group.

    None where that takes more freedom than all groups' rows have.
    """
    total, freedom = np.zeros((y.shape[1], y.shape[1])), 0
    for group in np.unique(groups):
        rows = groups == group
        terms = x[rows][:, np.ptp(x[rows], axis=0) > 0]
        degrees_left = int(rows.sum()) - 1 - terms.shape[1]
        if degrees_left < 1:
            continue
        terms = terms - terms.mean(axis=0)
        centred = y[rows] - y[rows].mean(axis=0)
        centred = centred - terms @ np.linalg.lstsq(terms, centred, rcond=None)[0]
        total += centred.T @ centred
        freedom += degrees_left
    return total / freedom if freedom > y.shape[1] else None
