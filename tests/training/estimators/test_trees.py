"""Trees as arrays against scikit-learn's own, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.training.estimators.ensemble import TreeEnsemble
from pyroshock.training.estimators.tree import DecisionTree
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


def test_single_precision_thresholds_part_as_scikit_learns_do() -> None:
    """Values between two numbers of single precision: asked in double they fell on the other side."""
    x = np.repeat(1 + np.arange(8) * 2.0**-23, 4)[:, None] + 1e-9
    y = np.repeat(np.arange(8.0), 4)[:, None]
    one = DecisionTree(1).fit(x, y, np.arange(32), np.random.default_rng(0))
    peer = DecisionTreeRegressor(random_state=0).fit(x, y)
    np.testing.assert_array_equal(one.predict(x).mean[:, 0], peer.predict(x))


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
    ("name", "at", "value"),
    [("children", (0, 0), 0), ("children", (0, 1), 10**6), ("predictor", 0, 13), ("roots", 0, -1), ("roots", 0, 10**6)],
)
def test_nodes_that_make_no_tree_are_refused(name: str, at: tuple[int, int] | int, value: int) -> None:
    """A child before its parent would be walked for ever."""
    arrays = fitted(DecisionTree(10)).arrays()
    arrays[name] = arrays[name].copy()
    arrays[name][at] = value
    with pytest.raises(ValueError, match="do not make trees"):
        DecisionTree(10).restore(arrays)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_infinite_numbers_are_refused(bad: float) -> None:
    arrays = fitted(DecisionTree(10)).arrays()
    arrays["mean"] = arrays["mean"].copy()
    arrays["mean"][0, 0] = bad
    with pytest.raises(ValueError, match="'mean' must hold finite numbers"):
        DecisionTree(10).restore(arrays)


def test_objects_are_refused() -> None:
    arrays = fitted(DecisionTree(10)).arrays()
    with pytest.raises(ValueError, match="finite numbers"):
        DecisionTree(10).restore({**arrays, "roots": np.array([object()])})


def test_arrays_that_do_not_fit_each_other_are_refused() -> None:
    arrays = fitted(DecisionTree(10)).arrays()
    with pytest.raises(ValueError, match="'variance' has the shape"):
        DecisionTree(10).restore({**arrays, "variance": arrays["variance"][:, :5]})
