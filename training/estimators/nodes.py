"""Regression trees as arrays: the nodes of one tree or of many, and the way of a row to its leaves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .base import Arrays, Floats, Gaussian
from .learned import LearnedArrays, Shape

#: Of a leaf: no predictor is asked, no child follows.
LEAF = -1


class GrownTrees(LearnedArrays):
    """Trees from scikit-learn. A node without children is a leaf; `mean` and `variance` are its pulses', n - 1 below.

    The spread is that of a new measurement drawn from the leaves a row falls into: the variance inside them and
    between the trees, as in Meinshausen, Quantile regression forests, JMLR 7 (2006), without its quantiles.
    """

    def shapes(self) -> Mapping[str, Shape]:
        return {
            "predictors": (1,),
            "roots": ("t",),
            "predictor": ("k",),
            "threshold": ("k",),
            "children": ("k", 2),
            "mean": ("k", "m"),
            "variance": ("k", "m"),
        }

    def predict(self, x: Floats) -> Gaussian:
        learned = self._learned()
        rows = _single(self._asked(x, int(learned["predictors"][0])))
        outputs = learned["mean"].shape[1]
        first, second = np.zeros((len(rows), outputs)), np.zeros((len(rows), outputs))
        for root in learned["roots"]:
            leaves = leaves_of(learned, rows, int(root))
            first += learned["mean"][leaves]
            second += learned["variance"][leaves] + learned["mean"][leaves] ** 2
        trees = len(learned["roots"])
        mean = first / trees
        return Gaussian(mean, np.sqrt(np.maximum(second / trees - mean**2, 0.0)))

    def _check(self, arrays: Arrays) -> dict[str, int]:
        """Also: every way down ends, because children stand behind their parents."""
        lengths = super()._check(arrays)
        nodes, children, asked = np.arange(lengths["k"]), arrays["children"], arrays["predictor"]
        if any(arrays[name].dtype.kind != "i" for name in ("predictors", "roots", "predictor", "children")):
            raise ValueError(f"{self.kind!r}: the positions of nodes must be whole numbers")
        inner = children[:, 0] != LEAF
        orderly = np.all((children[inner] > nodes[inner, None]) & (children[inner] < len(nodes)))
        known = np.all((asked[inner] >= 0) & (asked[inner] < arrays["predictors"][0]))
        rooted = lengths["t"] > 0 and np.all((arrays["roots"] >= 0) & (arrays["roots"] < len(nodes)))
        if not (orderly and known and rooted):
            raise ValueError(f"{self.kind!r}: its nodes do not make trees")
        return lengths


def arrays_of(trees: Sequence[Any], x: Floats, y: Floats) -> Arrays:
    """Fitted `DecisionTreeRegressor`s, with the mean and variance of the rows x (n x d), y (n x m) in each leaf."""
    parts, offset, roots = [], 0, []
    for tree in (fitted.tree_ for fitted in trees):
        roots.append(offset)
        leaves = tree.children_left == LEAF
        children = np.stack([tree.children_left, tree.children_right], axis=1).astype(np.int64)
        mean = tree.value[:, :, 0]
        parts.append(
            {
                "predictor": np.where(leaves, LEAF, tree.feature).astype(np.int64),
                "threshold": np.where(leaves, 0.0, tree.threshold),
                "children": np.where(leaves[:, None], LEAF, children + offset),
                "mean": mean,
                "variance": _variances(tree.apply(_single(x).astype(np.float32)), mean, y),
            }
        )
        offset += tree.node_count
    joined = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    return {"predictors": np.array([x.shape[1]]), "roots": np.array(roots, dtype=np.int64), **joined}


def _variances(leaf: NDArray[np.int64], mean: Floats, y: Floats) -> Floats:
    """Of the rows y (n x m) in each node (k x m) about the node's mean; 0 where no row ends."""
    total, count = np.zeros_like(mean), np.bincount(leaf, minlength=len(mean))
    np.add.at(total, leaf, (y - mean[leaf]) ** 2)
    return total / np.maximum(count - 1, 1)[:, None]


def leaves_of(learned: Arrays, rows: Floats, root: int) -> NDArray[np.int64]:
    """The node (n,) in which each row's way from the root ends."""
    at = np.full(len(rows), root, dtype=np.int64)
    while True:
        going = np.flatnonzero(learned["children"][at, 0] != LEAF)
        if not len(going):
            return at
        node = at[going]
        right = rows[going, learned["predictor"][node]] > learned["threshold"][node]
        at[going] = learned["children"][node, right.astype(np.int64)]


def _single(x: Floats) -> Floats:
    """Rounded as scikit-learn rounds what its trees are asked: to single precision."""
    return x.astype(np.float32).astype(np.float64)
