"""Partial least squares (thesis, section 4.3.2; MATLAB's `plsregress`)."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from ...array_types import Floats
from .scikit_pipeline import PipelineRegression, scaling_pipeline


@dataclass(eq=False)
class PartialLeastSquares(PipelineRegression):
    """A linear law through a few directions of the predictors, those that share most with all outputs together.

    `components` of them, no more than the predictors have independent directions. Predictors and outputs are
    standardised, which `plsregress` does not do. Linear in plain predictors: no powers.
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
    """Rank of the standardised rows x (n x d), at least 1. PLSRegression goes on in the rounding beyond it."""
    from sklearn import clone

    return max(1, int(np.linalg.matrix_rank(clone(pipeline[:-1]).fit_transform(x))))
