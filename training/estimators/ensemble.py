"""An ensemble of trees: bagged, not boosted."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, Self

from ...array_types import Floats
from .leaf_spread import TreeRegression


@dataclass(eq=False)
class TreeEnsemble(TreeRegression):
    """`trees` trees on bootstrap samples of the pulses, every predictor asked at each split (Breiman, 1996).

    MATLAB's `fitrensemble` boosts by default (LSBoost) and offers bags, with 5 pulses to a leaf, beside it;
    the thesis does not say which it took. Bags: one forest learns all outputs together, and its leaves give an honest
    spread, which boosting on squared errors does not have.
    """

    trees: int = 100
    min_leaf: int = 5

    kind: ClassVar[str] = "ensemble"
    parameters: ClassVar = {"trees": "n_estimators", "min_leaf": "min_samples_leaf"}

    def pipeline(self, seed: int) -> Any:
        from sklearn.ensemble import RandomForestRegressor

        return RandomForestRegressor(random_state=seed)

    def _learn(self, regressor: Any, x: Floats, y: Floats) -> Self:
        return super()._learn(regressor, x, y[:, 0] if y.shape[1] == 1 else y)  # scikit-learn warns of one column
