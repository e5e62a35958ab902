"""Covariances against scikit-learn's, their derivatives against differences."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.training.gp.kernels import KERNELS, kernel_and_slope, kernel_matrix, lengthscale_gradient

RNG = np.random.default_rng(3)
A, B = RNG.normal(size=(9, 4)), RNG.normal(size=(6, 4))


@pytest.mark.parametrize("kind", KERNELS)
def test_kernel_like_sklearn(kind: str) -> None:
    peers = pytest.importorskip("sklearn.gaussian_process.kernels")
    peer = {
        "rbf": peers.RBF(1.0),
        "matern32": peers.Matern(1.0, nu=1.5),
        "matern52": peers.Matern(1.0, nu=2.5),
        "rational-quadratic": peers.RationalQuadratic(1.0, 1.0),
    }[kind]
    np.testing.assert_allclose(kernel_matrix(kind, A, B), peer(A, B), atol=1e-14)


@pytest.mark.parametrize("kind", KERNELS)
def test_diagonal_is_one(kind: str) -> None:
    k, _ = kernel_and_slope(kind, A)
    np.testing.assert_array_equal(k.diagonal(), 1.0)
    np.testing.assert_allclose(k, k.T, rtol=1e-13)


@pytest.mark.parametrize("kind", KERNELS)
def test_gradient_by_lengthscales(kind: str) -> None:
    weights = RNG.normal(size=(9, 9))
    weights += weights.T
    _, slope = kernel_and_slope(kind, A)
    found = lengthscale_gradient(A, weights * slope)
    steps = 1e-5 * np.eye(4)
    ends = [[(weights * kernel_matrix(kind, a, a)).sum() for a in (A / np.exp(s), A / np.exp(-s))] for s in steps]
    np.testing.assert_allclose(found, [(up - down) / 2e-5 for up, down in ends], rtol=1e-7, atol=1e-7)


def test_inputs_are_left_alone() -> None:
    before = A.copy()
    kernel_and_slope("matern52", A)
    np.testing.assert_array_equal(A, before)


def test_unknown_kernel() -> None:
    with pytest.raises(LookupError, match=r"periodic.*rbf, matern32"):
        kernel_matrix("periodic", A, B)
