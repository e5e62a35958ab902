"""Regressions that end as a sum of Gaussian kernels on some of the rows they learned from."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Self

import numpy as np

from .base import Floats, Gaussian
from .learned import LearnedArrays, Shape
from .standard import Standard

#: Rows asked at a time: their kernel with 1,440 centres is 24 MB.
ROWS = 2048


class KernelExpansion(LearnedArrays):
    """f(x) = sum over centres c of weights_c k(x, c) + offset, in standardised predictors and outputs. No spread."""

    def shapes(self) -> Mapping[str, Shape]:
        return {
            "x_mean": ("d",),
            "x_width": ("d",),
            "y_mean": ("m",),
            "y_width": ("m",),
            "centres": ("c", "d"),
            "weights": ("c", "m"),
            "offset": ("m",),
            "tuned": ("t",),
        }

    def predict(self, x: Floats) -> Gaussian:
        learned = self._learned()
        inputs = Standard(learned["x_mean"], learned["x_width"])
        outputs = Standard(learned["y_mean"], learned["y_width"])
        z, gamma = inputs.apply(self._asked(x, len(inputs.mean))), float(learned["tuned"][0])
        parts = [
            gaussian_kernel(z[start : start + ROWS], learned["centres"], gamma) @ learned["weights"]
            for start in range(0, len(z), ROWS)
        ]
        sums = np.concatenate(parts) if parts else np.zeros((0, len(learned["offset"])))
        return Gaussian(outputs.undo(sums + learned["offset"]), None)

    def _expanded(
        self, inputs: Standard, outputs: Standard, centres: Floats, weights: Floats, offset: Floats, tuned: Floats
    ) -> Self:
        """Learned: c centres (c x d), their weights (c x m), an offset (m,); gamma is the first of what was tuned."""
        return self.restore(
            {
                "x_mean": inputs.mean,
                "x_width": inputs.width,
                "y_mean": outputs.mean,
                "y_width": outputs.width,
                "centres": centres,
                "weights": weights,
                "offset": offset,
                "tuned": tuned,
            }
        )


def squared_distances(a: Floats, b: Floats) -> Floats:
    """Between the rows of a (n x d) and b (k x d), n x k."""
    from scipy.spatial.distance import cdist

    distances: Floats = cdist(a, b, "sqeuclidean")
    return distances


def gaussian_kernel(a: Floats, b: Floats, gamma: float) -> Floats:
    """exp(-gamma |a - b|^2), n x k; eq. 4.9 with lambda = 1 / (2 gamma) and without the factor before it."""
    return np.exp(-gamma * squared_distances(a, b))
