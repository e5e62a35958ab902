"""Kernel regression by least squares with the Gaussian kernel (thesis, eq. 4.9)."""

from __future__ import annotations

from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from .base import Floats
from .expansion import KernelExpansion, gaussian_kernel, squared_distances
from .standard import Standard

#: Squared distances of standardised predictors are weighted by gamma; alpha is the ridge on the diagonal.
GAMMAS = tuple(np.geomspace(0.003, 1.0, 6))
ALPHAS = tuple(np.geomspace(1e-4, 10.0, 6))


class KernelRidge(KernelExpansion):
    """All outputs on one kernel matrix, solved exactly by scikit-learn.

    MATLAB's `fitrkernel` with the "leastsquares" learner, which the thesis used, approaches the same law by random
    features, one output at a time, on raw predictors. `gamma` and `alpha` left open are chosen by the error of
    left-out configurations, in closed form: no fold is fitted again (`left_out_errors`).
    """

    kind = "kernel-ridge"

    def __init__(self, gamma: float | None = None, alpha: float | None = None) -> None:
        self.gamma, self.alpha = gamma, alpha

    def settings(self) -> dict[str, Any]:
        return {"gamma": self.gamma, "alpha": self.alpha}

    def fit(self, x: Floats, y: Floats, groups: NDArray[Any], rng: np.random.Generator) -> Self:  # noqa: ARG002
        gammas = GAMMAS if self.gamma is None else (self.gamma,)
        alphas = ALPHAS if self.alpha is None else (self.alpha,)
        if len(gammas) == len(alphas) == 1:
            return self._learn(x, y, gammas[0], alphas[0])
        z, targets = Standard.of(x).apply(x), Standard.of(y).apply(y)
        distances = squared_distances(z, z)
        scores = {
            (gamma, alpha): float(np.sum(left_out_errors(np.exp(-gamma * distances), targets, groups, alpha) ** 2))
            for gamma in gammas
            for alpha in alphas
        }
        return self._learn(x, y, *min(scores, key=scores.__getitem__))

    def refit(self, x: Floats, y: Floats, groups: NDArray[Any], rng: np.random.Generator) -> Self:  # noqa: ARG002
        gamma, alpha = self._learned()["tuned"]
        return type(self)(**self.settings())._learn(x, y, float(gamma), float(alpha))

    def _learn(self, x: Floats, y: Floats, gamma: float, alpha: float) -> Self:
        from sklearn.kernel_ridge import KernelRidge as Ridge

        inputs, outputs = Standard.of(x), Standard.of(y)
        z = inputs.apply(x)
        weights = Ridge(alpha, kernel="precomputed").fit(gaussian_kernel(z, z, gamma), outputs.apply(y)).dual_coef_
        return self._expanded(inputs, outputs, z, weights, np.zeros(y.shape[1]), np.array([gamma, alpha]))


def left_out_errors(kernel: Floats, y: Floats, groups: NDArray[Any], alpha: float) -> Floats:
    """Errors (n x m) of each row where its group was left out: with A = (K + alpha I)^-1, they solve A_gg e = (A y)_g.

    The rows of the block inverse; Rifkin and Lippert, Notes on regularized least squares, MIT (2007), for single rows.
    """
    from scipy.linalg import cho_factor, cho_solve

    inverse = cho_solve(cho_factor(kernel + alpha * np.eye(len(kernel)), lower=True), np.eye(len(kernel)))
    pulled, errors = inverse @ y, np.empty_like(y)
    for group in np.unique(groups):
        rows = np.flatnonzero(groups == group)
        errors[rows] = np.linalg.solve(inverse[np.ix_(rows, rows)], pulled[rows])
    return errors
