"""Linear powers, partial least squares, kernels and trees against closed forms and scikit-learn."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.training.estimators.linear import KernelRidge, LinearPowers, PartialLeastSquares
from pyroshock.training.estimators.scikit_pipeline import PipelineRegression
from pyroshock.training.estimators.support_vectors import SupportVectorKernel, SupportVectors
from pyroshock.training.estimators.trees import DecisionTree, TreeEnsemble
from pyroshock.training.tuning.folds import grouped_folds
from scipy.spatial.distance import cdist
from sklearn.cross_decomposition import PLSRegression
from sklearn.ensemble import RandomForestRegressor
from sklearn.svm import SVR
from sklearn.tree import DecisionTreeRegressor
from support.checks.estimator_checks import fitted, known_law


def standardised() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Predictors and forces of 240 pulses and predictors of 60 others, columns that vary over their
    deviation."""
    learned, new_inputs = known_law()
    varied = np.ptp(learned.x, axis=0) > 0
    mean, width = learned.x[:, varied].mean(axis=0), learned.x[:, varied].std(axis=0)
    targets = (learned.y - learned.y.mean(axis=0)) / output_widths()
    return (learned.x[:, varied] - mean) / width, targets, (new_inputs.x[:, varied] - mean) / width


def newtons(targets: np.ndarray) -> np.ndarray:
    learned = known_law()[0]
    return targets * output_widths() + learned.y.mean(axis=0)


def output_widths() -> np.ndarray:
    """Standard deviations of the forces; 1 for a point that is 0 in each pulse but for rounding."""
    width = known_law()[0].y.std(axis=0)
    return np.where(width > 1e-9 * width.max(), width, 1.0)


def test_kernel_ridge_solves_the_ridge() -> None:
    z, targets, new_inputs = standardised()
    kernel = np.exp(-0.05 * cdist(z, z, "sqeuclidean"))
    weights = np.linalg.solve(kernel + 0.01 * np.eye(len(z)), targets)
    truth = newtons(np.exp(-0.05 * cdist(new_inputs, z, "sqeuclidean")) @ weights)
    learned, unseen = known_law()
    ridge = fitted(KernelRidge(gamma=0.05, alpha=0.01))
    predicted = ridge.predict(unseen.x).mean
    np.testing.assert_allclose(predicted, truth, rtol=1e-6, atol=1e-6)
    assert ridge.predict(unseen.x[:0]).mean.shape == (0, 20)
    # A predictor that never varied does not count, whatever is asked of it later.
    constant = np.full((len(learned.x), 1), 7e10)
    wider = KernelRidge(gamma=0.05, alpha=0.01)
    wider.fit(np.hstack([learned.x, constant]), learned.y, learned.groups, np.random.default_rng(5))
    other = np.hstack([unseen.x, np.full((len(unseen.x), 1), 2e11)])
    np.testing.assert_array_equal(wider.predict(other).mean, predicted)


def test_support_vectors_are_machines_of_each_output() -> None:
    z, targets, new_inputs = standardised()
    peers = [
        SVR(gamma=0.05, C=5.0, epsilon=0.05).fit(z, target).predict(new_inputs)
        for target in targets.T
    ]
    predicted = (
        fitted(SupportVectors(gamma=0.05, cost=5.0, epsilon=0.05)).predict(known_law()[1].x).mean
    )
    # LIBSVM stops within 1e-3 of standardised outputs; how columns are summed decides where
    np.testing.assert_allclose(
        predicted, newtons(np.stack(peers, axis=1)), atol=5e-3 * output_widths().max()
    )
    # A tube as wide as the pulses leaves one constant.
    mean = (
        fitted(SupportVectors(gamma=0.05, cost=5.0, epsilon=100.0)).predict(known_law()[1].x).mean
    )
    np.testing.assert_array_equal(mean, np.tile(mean[0], (len(mean), 1)))


def test_all_pulses_as_features_are_the_kernel() -> None:
    """As many as there are pulses, the inner product of the features is the kernel itself."""
    estimator_fit = fitted(SupportVectorKernel(features=1000, gamma=0.1, cost=1.0))
    assert isinstance(estimator_fit, SupportVectorKernel)
    z, _, _ = standardised()
    features = estimator_fit.regressor_[:-1].transform(known_law()[0].x)
    assert features.shape == (240, 240)
    np.testing.assert_allclose(
        features @ features.T, np.exp(-0.1 * cdist(z, z, "sqeuclidean")), atol=1e-6
    )


def test_kernel_ridge_chooses_the_least_left_out_error() -> None:
    """Every pair of settings by brute force, on the same folds."""
    z, targets, _ = standardised()
    rows = known_law()[0]
    rng = np.random.default_rng(5)
    rng.integers(2**31)
    folds = grouped_folds(rows.groups, KernelRidge.folds, rng)
    distances = cdist(z, z, "sqeuclidean")

    def error(gamma: float, alpha: float) -> float:
        kernel, wrong = np.exp(-gamma * distances), 0.0
        for fold in folds:
            part = kernel[np.ix_(~fold, ~fold)] + alpha * np.eye(int((~fold).sum()))
            offset = targets[~fold].mean(axis=0)
            weights = np.linalg.solve(part, targets[~fold] - offset)
            wrong += np.mean((kernel[np.ix_(fold, ~fold)] @ weights + offset - targets[fold]) ** 2)
        return wrong / len(folds)

    errors = {
        (g, a): error(g, a) for g in KernelRidge.grid["gamma"] for a in KernelRidge.grid["alpha"]
    }
    report = fitted(KernelRidge()).fit_report()
    assert errors[report.settings["gamma"], report.settings["alpha"]] < 1.1 * min(errors.values())
    assert min(report.histories["search_error"]) == pytest.approx(min(errors.values()), rel=0.1)
    assert len(report.histories["search_error"]) == len(errors)
    search = report.searches[""]
    tried = {(trial.settings["gamma"], trial.settings["alpha"]): trial for trial in search.trials}
    assert tried.keys() == errors.keys()
    assert all(tried[pair].score == pytest.approx(errors[pair], rel=0.1) for pair in errors)
    assert all(0 < trial.duration_s < 60 for trial in search.trials)
    assert search.logarithmic == ("gamma", "alpha")


@pytest.mark.parametrize(
    ("estimator", "searched"),
    [
        (KernelRidge(), ("gamma", "alpha")),
        (SupportVectors(cost=10.0), ("gamma",)),
        (SupportVectorKernel(64, gamma=0.1), ("cost",)),
    ],
    ids=lambda value: getattr(value, "kind", None),
)
def test_refit_keeps_what_was_chosen(
    estimator: PipelineRegression, searched: tuple[str, ...]
) -> None:
    """Also after a way through a file."""
    estimator_fit = fitted(estimator)
    chosen = estimator_fit.fit_report().settings
    assert all(chosen[name] in estimator.grid[name] for name in searched)
    rows = known_law()[0].take(np.arange(240) % 3 != 0)
    again = type(estimator)(**estimator.settings()).restore(estimator_fit.arrays())
    refitted = again.refit(rows.x, rows.y, rows.groups, np.random.default_rng(0))
    assert refitted.fit_report().settings == chosen
    assert not refitted.fit_report().histories
    assert not refitted.fit_report().searches


GROUPS = np.arange(400) // 4


def cubic(rng: np.random.Generator, noise: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    x = rng.standard_normal((400, 3)) * [1.0, 1e9, 1e-3] + [0.0, 5e9, 2e-3]
    u = (x - [0.0, 5e9, 2e-3]) / [1.0, 1e9, 1e-3]
    y = np.stack([1 + u[:, 0] - 2 * u[:, 1] ** 2 + u[:, 2] ** 3, 3 * u[:, 0] ** 3], axis=1)
    return x, y + noise * rng.standard_normal(y.shape)


def test_powers_hold_a_cubic_law() -> None:
    x, y = cubic(np.random.default_rng(0))
    answer = LinearPowers().fit(x, y, GROUPS, np.random.default_rng(0)).predict(x)
    np.testing.assert_allclose(answer.mean, y, atol=1e-8)
    answer = LinearPowers(powers=2).fit(x, y, GROUPS, np.random.default_rng(0)).predict(x)
    assert np.abs(answer.mean - y).max() > 1
    # Collinear columns, as a material's properties are: the shortest coefficients give the same
    # law.
    x, y = cubic(np.random.default_rng(0), noise=0.1)
    twice = np.concatenate([x, 7 * x[:, :1], np.full((400, 1), 3.0)], axis=1)
    once = LinearPowers().fit(x, y, GROUPS, np.random.default_rng(0)).predict(x)
    again = LinearPowers().fit(twice, y, GROUPS, np.random.default_rng(0)).predict(twice)
    assert once.spread is not None
    assert again.spread is not None
    np.testing.assert_allclose(again.mean, once.mean, atol=1e-8)
    np.testing.assert_allclose(again.spread, once.spread, rtol=1e-8)


def test_spread_covers_new_measurements_and_grows_away_from_data() -> None:
    # Of 800 new values of its own law, 90 in a hundred inside 1.645 spreads; the noise is found.
    x, y = cubic(np.random.default_rng(0), noise=0.5)
    new_x, new_y = cubic(np.random.default_rng(1), noise=0.5)
    powers = LinearPowers().fit(x, y, GROUPS, np.random.default_rng(0))
    answer = powers.predict(new_x)
    assert np.mean(np.abs(new_y - answer.mean) < 1.645 * answer.spread) == pytest.approx(
        0.9, abs=0.03
    )
    assert np.median(answer.spread) == pytest.approx(0.5, rel=0.1)
    spread = powers.predict(np.array([[10.0, 5e9, 2e-3]])).spread
    assert np.all(spread > 3)
    arrays = fitted(LinearPowers()).arrays()
    with pytest.raises(ValueError, match="'leverage_root' and 'variance' are not of"):
        LinearPowers().restore({**arrays, "leverage_root": arrays["leverage_root"][1:]})


def test_components_are_scikit_learns() -> None:
    learned, new_inputs = known_law()
    kept = np.ptp(learned.x, axis=0) > 0
    for components in (1, 3, 6):
        peer = (
            PLSRegression(components)
            .fit(learned.x[:, kept], learned.y)
            .predict(new_inputs.x[:, kept])
        )
        ours = fitted(PartialLeastSquares(components)).predict(new_inputs.x).mean
        np.testing.assert_allclose(ours, peer, rtol=1e-6, atol=1e-6)
    x, y = cubic(np.random.default_rng(0), noise=0.1)
    ours = PartialLeastSquares(3).fit(x, y, GROUPS, np.random.default_rng(0)).predict(x).mean
    plain = LinearPowers(powers=1).fit(x, y, GROUPS, np.random.default_rng(0)).predict(x).mean
    np.testing.assert_allclose(ours, plain, atol=1e-8)
    many, all_ = (
        fitted(PartialLeastSquares(number))
        for number in (13, np.linalg.matrix_rank(learned.x).item())
    )
    assert np.all(np.isfinite(many.predict(new_inputs.x).mean))
    assert many.fit_report().settings["components"] == np.linalg.matrix_rank(
        standard_columns(learned.x)
    )
    np.testing.assert_array_equal(many.predict(new_inputs.x).mean, all_.predict(new_inputs.x).mean)


def standard_columns(x: np.ndarray) -> np.ndarray:
    width = x.std(axis=0)
    return (x - x.mean(axis=0)) / np.where(np.ptp(x, axis=0) > 0, width, np.inf)


def test_components_are_chosen_from_left_out_configurations() -> None:
    """No number of them does much better on new rows than the one that was chosen, and some do
    worse."""
    rng = np.random.default_rng(0)
    law = rng.standard_normal((6, 2)) * np.array([5.0, 3, 1, 0, 0, 0])[:, None]
    x, new_x = rng.standard_normal((2, 400, 6)) @ rng.standard_normal((6, 6))
    y, new_y = (rows @ law + 0.5 * rng.standard_normal((400, 2)) for rows in (x, new_x))

    def error(components: int | None) -> float:
        estimator_fit = PartialLeastSquares(components).fit(x, y, GROUPS, np.random.default_rng(0))
        return float(np.mean((estimator_fit.predict(new_x).mean - new_y) ** 2))

    fixed = [error(components) for components in range(1, 7)]
    assert error(None) < 1.02 * min(fixed)
    assert max(fixed) > 1.5 * min(fixed)


def seed() -> int:
    return int(np.random.default_rng(5).integers(2**31))


def test_trees_and_ensembles_are_scikit_learns() -> None:
    learned, new_inputs = known_law()
    peer = DecisionTreeRegressor(min_samples_leaf=5, random_state=seed()).fit(learned.x, learned.y)
    np.testing.assert_array_equal(
        fitted(DecisionTree(5)).predict(new_inputs.x).mean, peer.predict(new_inputs.x)
    )
    peer = RandomForestRegressor(15, min_samples_leaf=3, random_state=seed()).fit(
        learned.x, learned.y
    )
    np.testing.assert_allclose(
        fitted(TreeEnsemble(15, 3)).predict(new_inputs.x).mean,
        peer.predict(new_inputs.x),
        rtol=1e-12,
    )


def test_leaves_hold_enough_pulses_and_their_standard_deviation() -> None:
    learned, _ = known_law()
    means = fitted(DecisionTree(36)).predict(learned.x).mean
    assert np.unique(means[:, 10], return_counts=True)[1].min() >= 36
    learned, new_inputs = known_law()
    spread = fitted(DecisionTree(len(learned.x))).predict(new_inputs.x[:1]).spread
    np.testing.assert_allclose(spread[0], learned.y.std(axis=0, ddof=1))


def test_spread_of_the_ensemble_covers_new_measurements() -> None:
    """A step with noise of 1 on one side, 3 on the other."""
    rng = np.random.default_rng(0)
    x, new_x = rng.uniform(-1, 1, (2, 2000, 1))
    law = lambda x: 10 * (x > 0) + np.where(x > 0, 3.0, 1.0) * rng.standard_normal(x.shape)  # noqa: E731
    estimator_fit = TreeEnsemble(30, 20).fit(x, law(x), np.arange(2000), np.random.default_rng(0))
    answer, y = estimator_fit.predict(new_x), law(new_x)
    assert np.mean(np.abs(y - answer.mean) < 1.645 * answer.spread) == pytest.approx(0.9, abs=0.03)
    right = new_x[:, 0] > 0.1
    assert np.median(answer.spread[right]) == pytest.approx(3, rel=0.15)
    assert np.median(answer.spread[new_x[:, 0] < -0.1]) == pytest.approx(1, rel=0.15)


@pytest.mark.parametrize(
    ("node", "field", "value"),
    [
        (0, "left_child", 0),
        (0, "right_child", 10**6),
        (0, "feature", 13),
        (1, "left_child", -7),
        (0, "feature", -2),
    ],
)
def test_nodes_that_make_no_tree_are_refused(node: int, field: str, value: int) -> None:
    """A child before its parent would be walked for ever; scikit-learn follows whatever index
    stands there."""
    estimator_fit = fitted(DecisionTree(10))
    assert isinstance(estimator_fit, DecisionTree)
    tree = estimator_fit.regressor_.tree_
    state = tree.__getstate__()
    state["nodes"] = state["nodes"].copy()
    state["nodes"][field][node] = value
    tree.__setstate__(state)
    arrays = estimator_fit.arrays()
    with pytest.raises(ValueError, match="do not make trees"):
        DecisionTree(10).restore(arrays)


@pytest.mark.parametrize(
    "change", [lambda v: v[:, :5], lambda v: v[:-1], lambda v: v * np.nan, None]
)
def test_variances_of_other_nodes_are_refused(change) -> None:
    arrays = fitted(DecisionTree(10)).arrays()
    if change is None:
        del arrays["leaf_variance"]
    else:
        arrays["leaf_variance"] = change(arrays["leaf_variance"])
    with pytest.raises(ValueError, match="'leaf_variance' must hold"):
        DecisionTree(10).restore(arrays)
