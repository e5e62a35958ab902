"""Linear regression on powers of each predictor (thesis, eq. 4.8 with X, X^2, X^3).

Partial least squares (thesis, section 4.3.2; MATLAB's `plsregress`).

Kernel regression by least squares with the Gaussian kernel (thesis, eq. 4.9).
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from ...array_types import Floats
from .base import Arrays
from .scikit_pipeline import PipelineRegression, scale_outputs, scaling_pipeline


@dataclass(eq=False)
class LinearPowers(PipelineRegression):
    """Least squares on 1, x, x^2 .. x^`powers` of each standardised predictor; no products of two.

    A material's properties rise and fall together, so most columns repeat others: of all
    coefficients that fit equally well, the shortest vector is taken. The spread is the interval of
    textbooks for a new measurement, one variance for each output: s^2 (1 + h), h the row's
    leverage.
    """

    powers: int = 3

    kind: ClassVar[str] = "linear"
    trusted: ClassVar = ("pyroshock.training.estimators.linear.powers_of",)

    def pipeline(self, seed: int) -> Any:  # noqa: ARG002
        from sklearn.linear_model import LinearRegression
        from sklearn.preprocessing import FunctionTransformer

        return scaling_pipeline(
            FunctionTransformer(powers_of, kw_args={"highest": self.powers}), LinearRegression()
        )

    def _spread_arrays(self, x: Floats, y: Floats) -> Arrays:
        terms = self._terms(x)
        _, singular, right = np.linalg.svd(terms, full_matrices=False)
        kept = singular > singular[0] * max(terms.shape) * np.finfo(np.float64).eps
        freedom = max(len(x) - int(kept.sum()), 1)
        variance = np.sum((y - self._regressor().predict(x)) ** 2, axis=0) / freedom
        return {"leverage_root": right[kept].T / singular[kept], "variance": variance}

    def _spread(self, x: Floats, mean: Floats) -> Floats:  # noqa: ARG002
        leverage = np.sum((self._terms(x) @ self.spread_["leverage_root"]) ** 2, axis=1)
        return np.asarray(np.sqrt((1 + leverage)[:, None] * self.spread_["variance"]))

    def _terms(self, x: Floats) -> Floats:
        return np.column_stack([np.ones(len(x)), self._regressor()[:-1].transform(x)])

    def _check(self, regressor: Any, spread: Arrays) -> None:
        super()._check(regressor, {})
        outputs, terms = regressor[-1].coef_.shape
        root, variance = (
            spread.get("leverage_root", np.zeros(0)),
            spread.get("variance", np.zeros(0)),
        )
        if root.shape[:1] != (terms + 1,) or root.ndim != 2 or variance.shape != (outputs,):
            raise ValueError(
                f"{self.kind!r}: 'leverage_root' and 'variance' are not of "
                f"{terms} terms, {outputs} outputs"
            )


def powers_of(columns: Floats, highest: int) -> Floats:
    """n x d to n x (d times `highest`); its name stands in the files of models."""
    return np.concatenate([columns**power for power in range(1, highest + 1)], axis=1)


@dataclass(eq=False)
class PartialLeastSquares(PipelineRegression):
    """A linear law through a few directions of the predictors, those that share most with all
    outputs together.

    `components` of them, no more than the predictors have independent directions. Predictors and
    outputs are standardised, which `plsregress` does not do. Linear in plain predictors: no powers.
    """

    components: int | None = None

    kind: ClassVar[str] = "pls"
    parameters: ClassVar = {"components": "plsregression__n_components"}
    grid: ClassVar = {"components": ()}
    folds: ClassVar[int] = 5
    search_outputs: ClassVar[int] = 20

    def pipeline(self, seed: int) -> Any:  # noqa: ARG002
        from sklearn.cross_decomposition import PLSRegression

        return scaling_pipeline(PLSRegression(sys.maxsize))

    def _candidates(self, regressor: Any) -> Mapping[str, Sequence[Any]]:
        return {"components": range(1, 1 + regressor.get_params()[self.parameters["components"]])}

    def _limit(self, regressor: Any, x: Floats) -> Any:
        name = self.parameters["components"]
        components = regressor.get_params()[name]
        return regressor.set_params(**{name: min(components, _directions(regressor, x))})


def _directions(pipeline: Any, x: Floats) -> int:
    """Rank of the standardised rows x (n x d), at least 1. PLSRegression goes on in the rounding
    beyond it."""
    from sklearn import clone

    return max(1, int(np.linalg.matrix_rank(clone(pipeline[:-1]).fit_transform(x))))


@dataclass(eq=False)
class KernelRidge(PipelineRegression):
    """All outputs on one kernel matrix: exp(-gamma |x - x_c|^2), which is eq. 4.9 with lambda = 1 /
    (2 gamma) and without the factor before it; `alpha` is the ridge on its diagonal.

    MATLAB's `fitrkernel` with the "leastsquares" learner, which the thesis used, approaches the
    same law by random features, one output at a time, on raw predictors.
    """

    gamma: float | None = None
    alpha: float | None = None

    kind: ClassVar[str] = "kernel-ridge"
    parameters: ClassVar = {
        "gamma": "regressor__kernelridge__gamma",
        "alpha": "regressor__kernelridge__alpha",
    }
    #: For standardised predictors and outputs.
    grid: ClassVar = {
        "gamma": np.geomspace(0.003, 1.0, 6).tolist(),
        "alpha": np.geomspace(1e-4, 1.0, 5).tolist(),
    }
    logarithmic: ClassVar = ("gamma", "alpha")
    folds: ClassVar[int] = 5
    search_outputs: ClassVar[int] = 20

    def pipeline(self, seed: int) -> Any:  # noqa: ARG002
        from sklearn.kernel_ridge import KernelRidge as Ridge

        return scale_outputs(scaling_pipeline(Ridge(kernel="rbf")))
