"""Trees and their spread: closed forms, scikit-learn's own, and nodes that make no tree."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.training.estimators.trees import DecisionTree, TreeEnsemble
from sklearn.ensemble import RandomForestRegressor
from sklearn.tree import DecisionTreeRegressor
from support.checks.estimator_checks import fitted, known_law


def seed() -> int:
    return int(np.random.default_rng(5).integers(2**31))


def test_tree_is_scikit_learns() -> None:
    learned, asked = known_law()
    peer = DecisionTreeRegressor(min_samples_leaf=5, random_state=seed()).fit(learned.x, learned.y)
    np.testing.assert_array_equal(fitted(DecisionTree(5)).predict(asked.x).mean, peer.predict(asked.x))


def test_ensemble_is_scikit_learns() -> None:
    learned, asked = known_law()
    peer = RandomForestRegressor(15, min_samples_leaf=3, random_state=seed()).fit(learned.x, learned.y)
    np.testing.assert_allclose(fitted(TreeEnsemble(15, 3)).predict(asked.x).mean, peer.predict(asked.x), rtol=1e-12)


def test_leaves_hold_enough_pulses() -> None:
    learned, _ = known_law()
    means = fitted(DecisionTree(36)).predict(learned.x).mean
    assert np.unique(means[:, 10], return_counts=True)[1].min() >= 36


def test_spread_of_one_leaf_is_the_sample_standard_deviation() -> None:
    learned, asked = known_law()
    spread = fitted(DecisionTree(len(learned.x))).predict(asked.x[:1]).spread
    assert spread is not None
    np.testing.assert_allclose(spread[0], learned.y.std(axis=0, ddof=1))


def test_spread_of_the_ensemble_covers_new_measurements() -> None:
    """A step with noise of 1 on one side, 3 on the other."""
    rng = np.random.default_rng(0)
    x, new_x = rng.uniform(-1, 1, (2, 2000, 1))
    law = lambda x: 10 * (x > 0) + np.where(x > 0, 3.0, 1.0) * rng.standard_normal(x.shape)  # noqa: E731
    one = TreeEnsemble(30, 20).fit(x, law(x), np.arange(2000), np.random.default_rng(0))
    answer, y = one.predict(new_x), law(new_x)
    assert answer.spread is not None
    assert np.mean(np.abs(y - answer.mean) < 1.645 * answer.spread) == pytest.approx(0.9, abs=0.03)
    right = new_x[:, 0] > 0.1
    assert np.median(answer.spread[right]) == pytest.approx(3, rel=0.15)
    assert np.median(answer.spread[new_x[:, 0] < -0.1]) == pytest.approx(1, rel=0.15)


@pytest.mark.parametrize(
    ("node", "field", "value"),
    [(0, "left_child", 0), (0, "right_child", 10**6), (0, "feature", 13), (1, "left_child", -7), (0, "feature", -2)],
)
def test_nodes_that_make_no_tree_are_refused(node: int, field: str, value: int) -> None:
    """A child before its parent would be walked for ever; scikit-learn follows whatever index stands there."""
    one = fitted(DecisionTree(10))
    assert isinstance(one, DecisionTree)
    tree = one.regressor_.tree_
    state = tree.__getstate__()
    state["nodes"] = state["nodes"].copy()
    state["nodes"][field][node] = value
    tree.__setstate__(state)
    arrays = one.arrays()
    with pytest.raises(ValueError, match="do not make trees"):
        DecisionTree(10).restore(arrays)


@pytest.mark.parametrize("change", [lambda v: v[:, :5], lambda v: v[:-1], lambda v: v * np.nan, None])
def test_variances_of_other_nodes_are_refused(change) -> None:
    arrays = fitted(DecisionTree(10)).arrays()
    if change is None:
        del arrays["leaf_variance"]
    else:
        arrays["leaf_variance"] = change(arrays["leaf_variance"])
    with pytest.raises(ValueError, match="'leaf_variance' must hold"):
        DecisionTree(10).restore(arrays)
