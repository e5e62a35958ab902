"""An ensemble of trees: bagged, not boosted."""

from __future__ import annotations

from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from .base import Floats
from .nodes import GrownTrees, arrays_of


class TreeEnsemble(GrownTrees):
    """`trees` trees on bootstrap samples of the pulses, every predictor asked at each split (Breiman, 1996).

    MATLAB's `fitrensemble` boosts by default (LSBoost) and offers bags, with 5 pulses to a leaf, beside it;
    the thesis does not say which it took. Bags: one forest learns all outputs together, and its leaves give an honest
    spread, which boosting on squared errors does not have.
    """

    kind = "ensemble"

    def __init__(self, trees: int = 100, min_leaf: int = 5) -> None:
        self.trees = trees
        self.min_leaf = min_leaf

    def settings(self) -> dict[str, Any]:
        return {"trees": self.trees, "min_leaf": self.min_leaf}

    def fit(self, x: Floats, y: Floats, groups: NDArray[Any], rng: np.random.Generator) -> Self:  # noqa: ARG002
        from sklearn.ensemble import RandomForestRegressor

        seed = int(rng.integers(2**31))
        forest = RandomForestRegressor(self.trees, min_samples_leaf=self.min_leaf, max_features=1.0, random_state=seed)
        # One output must come as a column's values, or scikit-learn warns.
        grown = forest.fit(x, y[:, 0] if y.shape[1] == 1 else y).estimators_
        return self.restore(arrays_of(grown, x, y))
