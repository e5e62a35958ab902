"""Kernel ridge, support vectors and their random features, against scikit-learn and by brute force."""

from __future__ import annotations

import numpy as np
from pyroshock.training.estimators.expansion import gaussian_kernel
from pyroshock.training.estimators.kernel_ridge import KernelRidge, left_out_errors
from pyroshock.training.estimators.standard import Standard
from pyroshock.training.estimators.svr import SupportVectors
from pyroshock.training.estimators.svr_kernel import SupportVectorKernel, _features
from sklearn.kernel_ridge import KernelRidge as Ridge
from sklearn.svm import SVR
from support.checks.estimator_checks import fitted, known_law


def standardised() -> tuple[np.ndarray, np.ndarray, np.ndarray, Standard]:
    learned, asked = known_law()
    inputs, outputs = Standard.of(learned.x), Standard.of(learned.y)
    return inputs.apply(learned.x), outputs.apply(learned.y), inputs.apply(asked.x), outputs


def test_kernel_ridge_is_scikit_learns() -> None:
    z, targets, asked, outputs = standardised()
    peer = Ridge(alpha=0.01, kernel="rbf", gamma=0.05).fit(z, targets).predict(asked)
    ours = fitted(KernelRidge(gamma=0.05, alpha=0.01)).predict(known_law()[1].x).mean
    np.testing.assert_allclose(ours, outputs.undo(peer), rtol=1e-6, atol=1e-6)


def test_left_out_errors_are_those_of_fitting_without() -> None:
    """Brute force: every configuration left out, the rest fitted again."""
    z, targets, _, _ = standardised()
    groups, kernel = known_law()[0].groups, gaussian_kernel(z, z, 0.05)
    errors = left_out_errors(kernel, targets, groups, 0.01)
    for group in np.unique(groups)[::7]:
        out = groups == group
        weights = np.linalg.solve(kernel[np.ix_(~out, ~out)] + 0.01 * np.eye(int((~out).sum())), targets[~out])
        np.testing.assert_allclose(errors[out], targets[out] - kernel[np.ix_(out, ~out)] @ weights, atol=1e-8)


def test_kernel_ridge_chooses_the_least_left_out_error() -> None:
    from pyroshock.training.estimators.kernel_ridge import ALPHAS, GAMMAS

    z, targets, _, _ = standardised()
    groups = known_law()[0].groups
    scores = {
        (gamma, alpha): np.sum(left_out_errors(gaussian_kernel(z, z, gamma), targets, groups, alpha) ** 2)
        for gamma in GAMMAS
        for alpha in ALPHAS
    }
    best = min(scores, key=scores.__getitem__)
    np.testing.assert_allclose(fitted(KernelRidge()).arrays()["tuned"], best)


def test_refit_keeps_what_was_chosen() -> None:
    rows = known_law()[0].take(np.arange(240) % 3 != 0)
    for one in (fitted(KernelRidge()), fitted(SupportVectors(cost=10.0)), fitted(SupportVectorKernel(64, gamma=0.1))):
        again = one.refit(rows.x, rows.y, rows.groups, np.random.default_rng(0))
        np.testing.assert_array_equal(again.arrays()["tuned"], one.arrays()["tuned"])


def test_support_vectors_are_scikit_learns() -> None:
    z, targets, asked, outputs = standardised()
    peers = [SVR(gamma=0.05, C=5.0, epsilon=0.05).fit(z, target).predict(asked) for target in targets.T]
    ours = fitted(SupportVectors(gamma=0.05, cost=5.0, epsilon=0.05)).predict(known_law()[1].x).mean
    np.testing.assert_allclose(ours, outputs.undo(np.stack(peers, axis=1)), rtol=1e-3, atol=1e-2)


def test_errors_within_epsilon_support_nothing() -> None:
    """A tube as wide as the pulses leaves one constant."""
    weights = fitted(SupportVectors(gamma=0.05, cost=5.0, epsilon=100.0)).arrays()["weights"]
    assert not weights.any()


def test_random_features_stand_for_the_kernel() -> None:
    """Rahimi and Recht: the inner product's error falls as one over the root of the number."""
    rng, z = np.random.default_rng(0), np.random.default_rng(1).standard_normal((30, 13)) / 2
    frequencies, phases = SupportVectorKernel(features=40_000)._draw(13, rng)
    features = _features(z, np.sqrt(2 * 0.1) * frequencies, phases)
    np.testing.assert_allclose(features @ features.T, gaussian_kernel(z, z, 0.1), atol=5 / np.sqrt(40_000))


def test_many_rows_are_asked_in_parts() -> None:
    x = np.tile(known_law()[1].x, (40, 1))
    one = fitted(KernelRidge(gamma=0.05, alpha=0.01))
    parts, whole = one.predict(x).mean[-60:], one.predict(x[:60]).mean
    # relative to the pulse: a force of 1e-16 N at its ends is rounding, and differs from machine to machine
    np.testing.assert_allclose(parts, whole, rtol=1e-12, atol=1e-12 * np.abs(whole).max())
    assert one.predict(x[:0]).mean.shape == (0, 20)
