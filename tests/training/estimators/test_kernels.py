"""Kernel ridge, support vectors and features of the kernel: what they are, what they choose, what a refit keeps."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.training.estimators.linear import KernelRidge
from pyroshock.training.estimators.scikit_pipeline import PipelineRegression
from pyroshock.training.estimators.support_vectors import SupportVectorKernel, SupportVectors
from pyroshock.training.tuning.folds import grouped_folds
from scipy.spatial.distance import cdist
from sklearn.svm import SVR
from support.checks.estimator_checks import fitted, known_law


def standardised() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Predictors and forces of 240 pulses and predictors of 60 others, columns that vary over their deviation."""
    learned, asked = known_law()
    varied = np.ptp(learned.x, axis=0) > 0
    mean, width = learned.x[:, varied].mean(axis=0), learned.x[:, varied].std(axis=0)
    targets = (learned.y - learned.y.mean(axis=0)) / output_widths()
    return (learned.x[:, varied] - mean) / width, targets, (asked.x[:, varied] - mean) / width


def newtons(targets: np.ndarray) -> np.ndarray:
    learned = known_law()[0]
    return targets * output_widths() + learned.y.mean(axis=0)


def output_widths() -> np.ndarray:
    """Standard deviations of the forces; 1 for a point that is 0 in each pulse but for rounding."""
    width = known_law()[0].y.std(axis=0)
    return np.where(width > 1e-9 * width.max(), width, 1.0)


def test_kernel_ridge_solves_the_ridge() -> None:
    z, targets, asked = standardised()
    kernel = np.exp(-0.05 * cdist(z, z, "sqeuclidean"))
    weights = np.linalg.solve(kernel + 0.01 * np.eye(len(z)), targets)
    truth = newtons(np.exp(-0.05 * cdist(asked, z, "sqeuclidean")) @ weights)
    predicted = fitted(KernelRidge(gamma=0.05, alpha=0.01)).predict(known_law()[1].x).mean
    np.testing.assert_allclose(predicted, truth, rtol=1e-6, atol=1e-6)


def test_support_vectors_are_machines_of_each_output() -> None:
    z, targets, asked = standardised()
    peers = [SVR(gamma=0.05, C=5.0, epsilon=0.05).fit(z, target).predict(asked) for target in targets.T]
    predicted = fitted(SupportVectors(gamma=0.05, cost=5.0, epsilon=0.05)).predict(known_law()[1].x).mean
    # LIBSVM stops within 1e-3 of standardised outputs; how columns are summed decides where
    np.testing.assert_allclose(predicted, newtons(np.stack(peers, axis=1)), atol=5e-3 * output_widths().max())


def test_errors_within_epsilon_support_nothing() -> None:
    """A tube as wide as the pulses leaves one constant."""
    mean = fitted(SupportVectors(gamma=0.05, cost=5.0, epsilon=100.0)).predict(known_law()[1].x).mean
    np.testing.assert_array_equal(mean, np.tile(mean[0], (len(mean), 1)))


def test_all_pulses_as_features_are_the_kernel() -> None:
    """As many as there are pulses, the inner product of the features is the kernel itself."""
    one = fitted(SupportVectorKernel(features=1000, gamma=0.1, cost=1.0))
    assert isinstance(one, SupportVectorKernel)
    z, _, _ = standardised()
    features = one.regressor_[:-1].transform(known_law()[0].x)
    assert features.shape == (240, 240)
    np.testing.assert_allclose(features @ features.T, np.exp(-0.1 * cdist(z, z, "sqeuclidean")), atol=1e-6)


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

    errors = {(g, a): error(g, a) for g in KernelRidge.grid["gamma"] for a in KernelRidge.grid["alpha"]}
    report = fitted(KernelRidge()).fit_report()
    assert errors[report.settings["gamma"], report.settings["alpha"]] < 1.1 * min(errors.values())
    assert min(report.histories["search_error"]) == pytest.approx(min(errors.values()), rel=0.1)
    assert len(report.histories["search_error"]) == len(errors)


@pytest.mark.parametrize(
    ("estimator", "searched"),
    [
        (KernelRidge(), ("gamma", "alpha")),
        (SupportVectors(cost=10.0), ("gamma",)),
        (SupportVectorKernel(64, gamma=0.1), ("cost",)),
    ],
    ids=lambda value: getattr(value, "kind", None),
)
def test_refit_keeps_what_was_chosen(estimator: PipelineRegression, searched: tuple[str, ...]) -> None:
    """Also after a way through a file."""
    one = fitted(estimator)
    chosen = one.fit_report().settings
    assert all(chosen[name] in estimator.grid[name] for name in searched)
    rows = known_law()[0].take(np.arange(240) % 3 != 0)
    again = type(estimator)(**estimator.settings()).restore(one.arrays())
    refitted = again.refit(rows.x, rows.y, rows.groups, np.random.default_rng(0))
    assert refitted.fit_report().settings == chosen
    assert not refitted.fit_report().histories


def test_no_rows_give_no_pulses() -> None:
    assert fitted(KernelRidge(gamma=0.05, alpha=0.01)).predict(known_law()[1].x[:0]).mean.shape == (0, 20)


def test_predictor_that_never_varied_does_not_count() -> None:
    """Whatever is asked of it later."""
    learned, asked = known_law()
    constant = np.full((len(learned.x), 1), 7e10)
    one = KernelRidge(gamma=0.05, alpha=0.01)
    one.fit(np.hstack([learned.x, constant]), learned.y, learned.groups, np.random.default_rng(5))
    other = np.hstack([asked.x, np.full((len(asked.x), 1), 2e11)])
    expected = fitted(KernelRidge(gamma=0.05, alpha=0.01)).predict(asked.x).mean
    np.testing.assert_array_equal(one.predict(other).mean, expected)
