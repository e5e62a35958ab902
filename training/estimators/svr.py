"""Support vector regression with the Gaussian kernel, a machine for each output (thesis, section 4.3.2)."""

from __future__ import annotations

from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from ..tuning.folds import grouped_folds
from .base import Floats
from .expansion import KernelExpansion, gaussian_kernel
from .standard import Standard

#: For standardised predictors and outputs.
GAMMAS = (0.006, 0.02, 0.06, 0.2)
COSTS = (1.0, 10.0, 100.0)
#: Outputs that choose for all: neighbours on a pulse are too alike to be asked each.
ASKED = 4


class SupportVectors(KernelExpansion):
    """Epsilon-insensitive machines by scikit-learn (LIBSVM); `epsilon` in standard deviations of an output.

    MATLAB's `fitrsvm` ignores errors up to a tenth of an output's spread; soft tips' whole pulses are not much larger
    than that among those of hard ones, so ours ignores a fiftieth. `gamma` and `cost` left open are the same for all
    outputs, chosen by the squared error of left-out configurations (three folds, four of the outputs).
    """

    kind = "svr"

    def __init__(self, gamma: float | None = None, cost: float | None = None, epsilon: float = 0.02) -> None:
        self.gamma, self.cost, self.epsilon = gamma, cost, epsilon

    def settings(self) -> dict[str, Any]:
        return {"gamma": self.gamma, "cost": self.cost, "epsilon": self.epsilon}

    def fit(self, x: Floats, y: Floats, groups: NDArray[Any], rng: np.random.Generator) -> Self:
        gammas = GAMMAS if self.gamma is None else (self.gamma,)
        costs = COSTS if self.cost is None else (self.cost,)
        if len(gammas) == len(costs) == 1:
            return self._learn(x, y, gammas[0], costs[0])
        left_out = grouped_folds(groups, 3, rng)
        asked = np.unique(np.linspace(0, y.shape[1] - 1, ASKED + 2).astype(int)[1:-1])
        scores = {
            (gamma, cost): sum(self._wrong(x, y[:, asked], fold, gamma, cost) for fold in left_out)
            for gamma in gammas
            for cost in costs
        }
        return self._learn(x, y, *min(scores, key=scores.__getitem__))

    def refit(self, x: Floats, y: Floats, groups: NDArray[Any], rng: np.random.Generator) -> Self:  # noqa: ARG002
        gamma, cost = self._learned()["tuned"]
        return type(self)(**self.settings())._learn(x, y, float(gamma), float(cost))

    def _learn(self, x: Floats, y: Floats, gamma: float, cost: float) -> Self:
        inputs, outputs = Standard.of(x), Standard.of(y)
        z = inputs.apply(x)
        weights, offset = self._machines(gaussian_kernel(z, z, gamma), outputs.apply(y), cost)
        return self._expanded(inputs, outputs, z, weights, offset, np.array([gamma, cost]))

    def _machines(self, kernel: Floats, targets: Floats, cost: float) -> tuple[Floats, Floats]:
        """Weights of all rows (n x m), 0 for those that support nothing, and offsets (m,)."""
        from sklearn.svm import SVR

        weights, offset = np.zeros_like(targets), np.zeros(targets.shape[1])
        for output in range(targets.shape[1]):
            machine = SVR(kernel="precomputed", C=cost, epsilon=self.epsilon, cache_size=500)
            machine.fit(kernel, targets[:, output])
            weights[machine.support_, output], offset[output] = machine.dual_coef_[0], machine.intercept_[0]
        return weights, offset

    def _wrong(self, x: Floats, y: Floats, fold: NDArray[np.bool_], gamma: float, cost: float) -> float:
        """Sum of squared errors of a fold's rows, in the widths of the others' outputs."""
        inputs, outputs = Standard.of(x[~fold]), Standard.of(y[~fold])
        z = inputs.apply(x[~fold])
        weights, offset = self._machines(gaussian_kernel(z, z, gamma), outputs.apply(y[~fold]), cost)
        asked = gaussian_kernel(inputs.apply(x[fold]), z, gamma)
        return float(np.sum((asked @ weights + offset - outputs.apply(y[fold])) ** 2))
