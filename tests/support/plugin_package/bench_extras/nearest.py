"""The mean of the measured pulses that were made under the most similar conditions."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray
from pyroshock.array_types import Floats
from pyroshock.training.estimators.base import Gaussian, LearnedArrays, Shape, Standard


class NearestPulses(LearnedArrays):
    """`neighbours` rows nearest in standardised predictors, each with the same weight."""

    kind = "nearest-pulses"
    description = "The mean of the nearest measured pulses; it never leaves their range."

    def __init__(self, neighbours: int = 3) -> None:
        self.neighbours = neighbours

    def settings(self) -> dict[str, Any]:
        return {"neighbours": self.neighbours}

    def shapes(self) -> Mapping[str, Shape]:
        return {"x_mean": ("d",), "x_width": ("d",), "x": ("n", "d"), "y": ("n", "m")}

    def fit(self, x: Floats, y: Floats, groups: NDArray[Any], rng: np.random.Generator) -> Self:
        standard = Standard.of(x)
        rows = standard.apply(x)
        return self.restore({"x_mean": standard.mean, "x_width": standard.width, "x": rows, "y": y})

    def predict(self, x: Floats) -> Gaussian:
        learned = self._learned()
        standard = Standard(learned["x_mean"], learned["x_width"])
        inputs = standard.apply(self._asked(x, len(standard.mean)))
        distances = np.linalg.norm(inputs[:, None, :] - learned["x"], axis=-1)
        nearest = np.argsort(distances, axis=1, kind="stable")[:, : self.neighbours]
        return Gaussian(learned["y"][nearest].mean(axis=1), None)
