"""The decision tree, best of the thesis's contact-time models with at least 36 pulses in a leaf
(section 4.3.1).

An ensemble of trees: bagged, not boosted.

Regression trees, with the spread inside their leaves.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np

from ...array_types import Floats
from .base import Arrays
from .scikit_pipeline import PipelineRegression


class TreeRegression(PipelineRegression):
    """One tree or many. The spread is that of a new measurement drawn from the leaves a row falls
    into: the variance inside them (n - 1 below) and between the trees, as in Meinshausen, Quantile
    regression forests, JMLR 7 (2006), without its quantiles.
    """

    #: Its nodes are indices that scikit-learn follows without a check, and skops does not look at:
    #: `_check` does.
    trusted: ClassVar = ("sklearn.tree._tree.Tree",)

    def _spread_arrays(self, x: Floats, y: Floats) -> Arrays:
        return {
            "leaf_variance": np.concatenate(
                [_leaf_variance(tree, x, y) for tree in _trees(self._regressor())]
            )
        }

    def _spread(self, x: Floats, mean: Floats) -> Floats:
        second, begin, trees = np.zeros_like(mean), 0, _trees(self._regressor())
        rows = x.astype(np.float32)  # as scikit-learn rounds what its trees are asked
        for tree in trees:
            leaf = tree.tree_.apply(rows)
            second += (
                self.spread_["leaf_variance"][begin + leaf] + tree.tree_.value[leaf, :, 0] ** 2
            )
            begin += tree.tree_.node_count
        return np.asarray(np.sqrt(np.maximum(second / len(trees) - mean**2, 0.0)))

    def _check(self, regressor: Any, spread: Arrays) -> None:
        """Also: every way down ends, because children stand behind their parents."""
        super()._check(regressor, {})
        trees = _trees(regressor)
        for tree in trees:
            _check_nodes(self.kind, tree.tree_, regressor.n_features_in_)
        nodes = sum(tree.tree_.node_count for tree in trees)
        outputs = trees[0].tree_.value.shape[1]
        variance = spread.get("leaf_variance")
        if (
            variance is None
            or variance.shape != (nodes, outputs)
            or not np.all(np.isfinite(variance))
        ):
            raise ValueError(
                f"{self.kind!r}: 'leaf_variance' must hold {nodes} x {outputs} finite numbers"
            )


def _trees(regressor: Any) -> list[Any]:
    return list(getattr(regressor, "estimators_", [regressor]))


def _leaf_variance(tree: Any, x: Floats, y: Floats) -> Floats:
    """Of the rows y (n x m) in each node (k x m) about the node's mean; 0 where no row ends."""
    leaf, mean = tree.apply(x), tree.tree_.value[:, :, 0]
    total, count = np.zeros_like(mean), np.bincount(leaf, minlength=len(mean))
    np.add.at(total, leaf, (y.reshape(len(x), -1) - mean[leaf]) ** 2)
    return np.asarray(total / np.maximum(count - 1, 1)[:, None])


def _check_nodes(kind: str, tree: Any, predictors: int) -> None:
    nodes = np.arange(tree.node_count)
    children = np.stack([tree.children_left, tree.children_right], axis=1)
    inner = tree.children_left != -1
    orderly = np.all((children[inner] > nodes[inner, None]) & (children[inner] < len(nodes)))
    if not (
        len(nodes)
        and orderly
        and np.all((tree.feature[inner] >= 0) & (tree.feature[inner] < predictors))
    ):
        raise ValueError(f"{kind!r}: its nodes do not make trees")


@dataclass(eq=False)
class DecisionTree(TreeRegression):
    """One tree for all outputs together, split by the summed squared error; leaves of `min_leaf`
    pulses or more.

    MATLAB's holds one output: its twenty trees of a pulse could each split elsewhere.
    """

    min_leaf: int = 36

    kind: ClassVar[str] = "tree"
    parameters: ClassVar = {"min_leaf": "min_samples_leaf"}

    def pipeline(self, seed: int) -> Any:
        from sklearn.tree import DecisionTreeRegressor

        # Predictors that split equally well are tried in an order of chance: a seed, or trees
        # differ from run to run.
        return DecisionTreeRegressor(random_state=seed)


@dataclass(eq=False)
class TreeEnsemble(TreeRegression):
    """`trees` trees on bootstrap samples of the pulses, every predictor asked at each split
    (Breiman, 1996).

    MATLAB's `fitrensemble` boosts by default (LSBoost) and offers bags, with 5 pulses to a leaf,
    beside it; the thesis does not say which it took. Bags: one forest learns all outputs together,
    and its leaves give an honest spread, which boosting on squared errors does not have.
    """

    trees: int = 100
    min_leaf: int = 5

    kind: ClassVar[str] = "ensemble"
    parameters: ClassVar = {"trees": "n_estimators", "min_leaf": "min_samples_leaf"}

    def pipeline(self, seed: int) -> Any:
        from sklearn.ensemble import RandomForestRegressor

        return RandomForestRegressor(random_state=seed)

    def _learn(self, regressor: Any, x: Floats, y: Floats) -> Self:
        return super()._learn(
            regressor, x, y[:, 0] if y.shape[1] == 1 else y
        )  # scikit-learn warns of one column
