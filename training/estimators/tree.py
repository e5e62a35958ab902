"""The decision tree, best of the thesis's contact-time models with at least 36 pulses in a leaf (section 4.3.1)."""

from __future__ import annotations

from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from .base import Floats
from .nodes import GrownTrees, arrays_of


class DecisionTree(GrownTrees):
    """One tree for all outputs together, split by the summed squared error; leaves of `min_leaf` pulses or more.

    MATLAB's holds one output: its twenty trees of a pulse could each split elsewhere.
    """

    kind = "tree"

    def __init__(self, min_leaf: int = 36) -> None:
        self.min_leaf = min_leaf

    def settings(self) -> dict[str, Any]:
        return {"min_leaf": self.min_leaf}

    def fit(self, x: Floats, y: Floats, groups: NDArray[Any], rng: np.random.Generator) -> Self:  # noqa: ARG002
        from sklearn.tree import DecisionTreeRegressor

        # Predictors that split equally well are tried in an order of chance: a seed, or trees differ from run to run.
        seed = int(rng.integers(2**31))
        grown = DecisionTreeRegressor(min_samples_leaf=self.min_leaf, random_state=seed).fit(x, y)
        return self.restore(arrays_of([grown], x, y))
