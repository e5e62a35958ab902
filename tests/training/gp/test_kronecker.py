"""The likelihood against the dense one it stands for, its derivatives against differences and
automatic ones."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray
from pyroshock.training.gp.kernels import KERNELS, kernel_matrix
from pyroshock.training.gp.kronecker import TOLERANCE, Likelihood, factorise, likelihood
from support.records.pulse_tables import pulse_table

Floats = NDArray[np.float64]


def standard(columns: Floats) -> Floats:
    width = columns.std(axis=0)
    return (columns - columns.mean(axis=0)) / np.where(width > 1e-9, width, 1.0)


def pulses(n: int) -> tuple[Floats, Floats]:
    """n standardised pulses of the synthetic campaign: 13 predictors, 20 outputs, both ends of the
    force constant."""
    table = pulse_table(np.random.default_rng(2), repetitions=10)
    rows = np.random.default_rng(4).permutation(len(table))[:n]
    x = table.x[rows] / table.x.max(axis=0).clip(1e-9)
    return standard(x), standard(table.force_n[rows])


@dataclass(frozen=True)
class Numbers:
    """Of a coregional model."""

    lengthscales: Floats
    b: Floats
    sigma: Floats


def some_parameters(m: int = 20, d: int = 13, rank: int = 3) -> Numbers:
    rng = np.random.default_rng(5)
    lengthscales, loadings = np.exp(rng.normal(1.0, 0.3, d)), 0.5 * rng.normal(size=(m, rank))
    kappa, noise = np.exp(rng.normal(-4, 1, m)), np.exp(rng.normal(-5, 1, m))
    return Numbers(lengthscales, loadings @ loadings.T + np.diag(kappa), np.diag(noise))


def coregional_likelihood(
    k: Floats, y: Floats, b: Floats, sigma: Floats, tolerance: float = TOLERANCE
) -> Likelihood:
    """Of y (n x m) with K (n x n), B and Sigma (m x m)."""
    return likelihood(factorise(k, tolerance), y, b, sigma)


def dense(k: Floats, y: Floats, b: Floats, sigma: Floats) -> float:
    """By Cholesky of the whole n m x n m covariance, outputs of one row side by side."""
    lower = np.linalg.cholesky(np.kron(k, b) + np.kron(np.eye(len(k)), sigma))
    solved = np.linalg.solve(lower, y.ravel())
    return float(
        0.5 * solved @ solved + np.log(lower.diagonal()).sum() + 0.5 * y.size * np.log(2 * np.pi)
    )


@pytest.mark.parametrize("n", [45, 90])
@pytest.mark.parametrize("kind", KERNELS)
def test_likelihood_is_the_dense_one(kind: str, n: int) -> None:
    (x, y), at = pulses(n), some_parameters()
    k = kernel_matrix(kind, x / at.lengthscales, x / at.lengthscales)
    found = coregional_likelihood(k, y, at.b, at.sigma)
    expected = dense(k, y, at.b, at.sigma)
    assert abs(found.value - expected) < 1e-6
    assert abs(found.value - expected) <= found.bound + 1e-8


def test_likelihood_of_correlated_noise() -> None:
    (x, y), at = pulses(45), some_parameters()
    factor = 0.1 * np.random.default_rng(6).normal(size=(20, 20))
    sigma = factor @ factor.T + at.sigma
    k = kernel_matrix("rbf", x / at.lengthscales, x / at.lengthscales)
    assert abs(coregional_likelihood(k, y, at.b, sigma).value - dense(k, y, at.b, sigma)) < 1e-6
    with pytest.raises(ValueError, match="noise between outputs is not positive definite"):
        coregional_likelihood(
            np.eye(3), np.zeros((3, 2)), np.eye(2), np.array([[1.0, 2.0], [2.0, 1.0]])
        )


def test_repeated_eigenvalues_and_coarse_factors() -> None:
    # B and K with one eigenvalue many times, every row twice: where derivatives through `eigh` are
    # not numbers.
    y = np.random.default_rng(7).normal(size=(12, 5))
    k = np.kron(np.eye(6), np.ones((2, 2)))
    b, sigma = 0.7 * np.eye(5), 0.1 * np.eye(5)
    coarse = coregional_likelihood(k, y, b, sigma)
    assert abs(coarse.value - dense(k, y, b, sigma)) < 1e-10
    assert_derivatives(
        lambda k, b, sigma: coregional_likelihood(k, y, b, sigma).value, coarse, (k, b, sigma)
    )
    (x, y), at = pulses(90), some_parameters()
    k = kernel_matrix("rbf", x / at.lengthscales, x / at.lengthscales)
    exact = dense(k, y, at.b, at.sigma)
    for tolerance in (1e-3, 1e-5, 1e-7):
        coarse = coregional_likelihood(k, y, at.b, at.sigma, tolerance)
        assert 0 < abs(coarse.value - exact) <= coarse.bound


def assert_derivatives(
    value: Callable[..., float], found: object, at: tuple[Floats, Floats, Floats]
) -> None:
    """Along random symmetric positive directions, against central differences."""
    rng, step = np.random.default_rng(8), 1e-6
    for index, name in enumerate(("by_k", "by_b", "by_sigma")):
        direction = rng.normal(size=at[index].shape) / 3
        direction = direction @ direction.T
        up, down = list(at), list(at)
        # only forward in K, which has no smaller eigenvalue than 0
        up[index], down[index] = at[index] + 2 * step * direction, at[index] + step * direction
        slope = (4 * value(*down) - value(*up) - 3 * value(*at)) / (2 * step)
        assert slope == pytest.approx(float((getattr(found, name) * direction).sum()), rel=1e-4)


def test_matrix_and_output_derivatives() -> None:
    (x, y), at = pulses(40), some_parameters()
    k = kernel_matrix("matern32", x / at.lengthscales, x / at.lengthscales)
    found = coregional_likelihood(k, y, at.b, at.sigma)
    assert_derivatives(
        lambda *now: coregional_likelihood(now[0], y, *now[1:]).value, found, (k, at.b, at.sigma)
    )
    k = kernel_matrix("rbf", x / at.lengthscales, x / at.lengthscales)
    found = coregional_likelihood(k, y, at.b, at.sigma)
    step = 1e-4 * np.random.default_rng(1).normal(size=y.shape)
    up, down = (coregional_likelihood(k, y + sign * step, at.b, at.sigma).value for sign in (1, -1))
    assert (up - down) / 2 == pytest.approx(float((found.by_y * step).sum()), rel=1e-6)


def test_factor_keeps_its_promise() -> None:
    """K - T T' has no more trace than said, and neither negative nor large entries."""
    x, _ = pulses(300)
    k = kernel_matrix("rbf", x / 4, x / 4)
    before, factor = k.copy(), factorise(k, 1e-10)
    left = k - factor.t @ factor.t.T
    np.testing.assert_array_equal(k, before)
    assert len(factor.eigenvalues) < 200
    assert np.trace(left) == pytest.approx(factor.residual, rel=1e-2, abs=1e-11)
    assert np.abs(left).max() <= 1.01e-10
    np.testing.assert_allclose(factor.t.T @ factor.t, np.diag(factor.eigenvalues), atol=1e-10)
