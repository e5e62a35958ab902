"""Linear regression on powers of each predictor (thesis, eq. 4.8 with X, X^2, X^3)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from .base import Floats, Gaussian
from .learned import LearnedArrays, Shape
from .standard import Standard


class LinearPowers(LearnedArrays):
    """Least squares on 1, x, x^2 .. x^`powers` of each standardised predictor; no products of two.

    A material's properties rise and fall together, so most columns repeat others: of all coefficients that fit equally
    well, the shortest vector is taken. The spread is the interval of textbooks for a new measurement, one variance for
    each output: s^2 (1 + h), h the row's leverage.
    """

    kind = "linear"

    def __init__(self, powers: int = 3) -> None:
        self.powers = powers

    def settings(self) -> dict[str, Any]:
        return {"powers": self.powers}

    def shapes(self) -> Mapping[str, Shape]:
        return {
            "x_mean": ("d",),
            "x_width": ("d",),
            "coefficients": ("p", "m"),
            "leverage_root": ("p", "r"),
            "variance": ("m",),
        }

    def fit(self, x: Floats, y: Floats, groups: NDArray[Any], rng: np.random.Generator) -> Self:  # noqa: ARG002
        scale = Standard.of(x)
        terms = self._terms(scale.apply(x))
        left, singular, right = np.linalg.svd(terms, full_matrices=False)
        kept = singular > singular[0] * max(terms.shape) * np.finfo(np.float64).eps
        root = right[kept].T / singular[kept]  # p x r: the pseudo-inverse is root @ left.T
        coefficients = root @ (left[:, kept].T @ y)
        freedom = max(len(x) - int(kept.sum()), 1)
        variance = np.sum((y - terms @ coefficients) ** 2, axis=0) / freedom
        return self.restore(
            {
                "x_mean": scale.mean,
                "x_width": scale.width,
                "coefficients": coefficients,
                "leverage_root": root,
                "variance": variance,
            }
        )

    def predict(self, x: Floats) -> Gaussian:
        learned = self._learned()
        scale = Standard(learned["x_mean"], learned["x_width"])
        terms = self._terms(scale.apply(self._asked(x, len(scale.mean))))
        leverage = np.sum((terms @ learned["leverage_root"]) ** 2, axis=1)
        return Gaussian(terms @ learned["coefficients"], np.sqrt((1 + leverage)[:, None] * learned["variance"]))

    def _terms(self, z: Floats) -> Floats:
        return np.concatenate([np.ones((len(z), 1)), *(z**power for power in range(1, self.powers + 1))], axis=1)

    def _check(self, arrays: dict[str, NDArray[Any]]) -> dict[str, int]:
        lengths = super()._check(arrays)
        if lengths["p"] != 1 + self.powers * lengths["d"]:
            raise ValueError(f"{self.kind!r}: {lengths['p']} terms are not those of {self.powers} powers")
        return lengths
