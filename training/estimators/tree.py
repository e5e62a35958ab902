"""The decision tree, best of the thesis's contact-time models with at least 36 pulses in a leaf (section 4.3.1)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from .leaf_spread import TreeRegression


@dataclass(eq=False)
class DecisionTree(TreeRegression):
    """One tree for all outputs together, split by the summed squared error; leaves of `min_leaf` pulses or more.

    MATLAB's holds one output: its twenty trees of a pulse could each split elsewhere.
    """

    min_leaf: int = 36

    kind: ClassVar[str] = "tree"
    parameters: ClassVar = {"min_leaf": "min_samples_leaf"}

    def pipeline(self, seed: int) -> Any:
        from sklearn.tree import DecisionTreeRegressor

        # Predictors that split equally well are tried in an order of chance: a seed, or trees differ from run to run.
        return DecisionTreeRegressor(random_state=seed)
