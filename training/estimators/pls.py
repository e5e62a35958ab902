"""Partial least squares (thesis, section 4.3.2; MATLAB's `plsregress`)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from ..tuning.folds import grouped_folds
from .base import Floats, Gaussian
from .learned import LearnedArrays, Shape
from .standard import Standard


class PartialLeastSquares(LearnedArrays):
    """A linear law through a few directions of the predictors, those that share most with all outputs together.

    `components` of them; by default as many as predict left-out configurations best (five folds). Predictors and
    outputs are standardised, which `plsregress` does not do. Linear in plain predictors: no powers.
    """

    kind = "pls"

    def __init__(self, components: int | None = None) -> None:
        self.components = components

    def settings(self) -> dict[str, Any]:
        return {"components": self.components}

    def shapes(self) -> Mapping[str, Shape]:
        return {
            "x_mean": ("d",),
            "x_width": ("d",),
            "y_mean": ("m",),
            "y_width": ("m",),
            "coefficients": ("d", "m"),
            "components": (1,),
        }

    def fit(self, x: Floats, y: Floats, groups: NDArray[Any], rng: np.random.Generator) -> Self:
        if self.components is not None:
            return self._learn(x, y, self.components)
        left_out = grouped_folds(groups, 5, rng)
        possible = min(int(np.linalg.matrix_rank(Standard.of(x[~fold]).apply(x[~fold]))) for fold in left_out)
        wrong = [sum(_wrong(x, y, fold, number) for fold in left_out) for number in range(1, possible + 1)]
        return self._learn(x, y, 1 + int(np.argmin(wrong)))

    def refit(self, x: Floats, y: Floats, groups: NDArray[Any], rng: np.random.Generator) -> Self:  # noqa: ARG002
        return type(self)(**self.settings())._learn(x, y, int(self._learned()["components"][0]))

    def predict(self, x: Floats) -> Gaussian:
        learned = self._learned()
        inputs = Standard(learned["x_mean"], learned["x_width"])
        outputs = Standard(learned["y_mean"], learned["y_width"])
        asked = inputs.apply(self._asked(x, len(inputs.mean)))
        return Gaussian(outputs.undo(asked @ learned["coefficients"]), None)

    def _learn(self, x: Floats, y: Floats, components: int) -> Self:
        inputs, outputs = Standard.of(x), Standard.of(y)
        return self.restore(
            {
                "x_mean": inputs.mean,
                "x_width": inputs.width,
                "y_mean": outputs.mean,
                "y_width": outputs.width,
                "coefficients": _coefficients(inputs.apply(x), outputs.apply(y), components),
                "components": np.array([components]),
            }
        )


def _coefficients(z: Floats, targets: Floats, components: int) -> Floats:
    """d x m, of standardised columns. No more components than z has directions."""
    from sklearn.cross_decomposition import PLSRegression

    kept = max(1, min(components, int(np.linalg.matrix_rank(z))))
    coefficients: Floats = PLSRegression(kept, scale=False).fit(z, targets).coef_.T
    return coefficients


def _wrong(x: Floats, y: Floats, fold: NDArray[np.bool_], components: int) -> float:
    """Sum of squared errors of a fold's rows, in the widths of the others' outputs."""
    inputs, outputs = Standard.of(x[~fold]), Standard.of(y[~fold])
    coefficients = _coefficients(inputs.apply(x[~fold]), outputs.apply(y[~fold]), components)
    return float(np.sum((inputs.apply(x[fold]) @ coefficients - outputs.apply(y[fold])) ** 2))
