"""Predictions against the dense formulas."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from pyroshock.training.gp.kernels import KERNELS, kernel_matrix
from pyroshock.training.gp.parameters import Parameters
from pyroshock.training.gp.posterior import posterior

Floats = NDArray[np.float64]
RNG = np.random.default_rng(11)
X, Y, ASKED = RNG.normal(size=(40, 3)), RNG.normal(size=(40, 4)), RNG.normal(size=(7, 3))
AT = Parameters(
    np.log([2.0, 3.0, 1.5]), 0.7 * RNG.normal(size=(4, 2)), RNG.normal(-3, 1, 4), np.log([0.1, 0.01, 1e-4, 0.3])
)


def dense(kind: str) -> tuple[Floats, Floats]:
    """Rasmussen and Williams 2006, equations 2.25 and 2.26, on the whole covariance; noise included."""
    a, asked = X / AT.lengthscales, ASKED / AT.lengthscales
    covariance = np.kron(kernel_matrix(kind, a, a), AT.b) + np.kron(np.eye(40), AT.sigma)
    across = np.kron(kernel_matrix(kind, asked, a), AT.b)
    solved = np.linalg.solve(covariance, np.column_stack([Y.ravel(), across.T]))
    prior = np.kron(np.eye(7), AT.b + AT.sigma).diagonal()
    variance = prior - np.einsum("ij,ji->i", across, solved[:, 1:])
    return (across @ solved[:, 0]).reshape(7, 4), np.sqrt(variance).reshape(7, 4)


@pytest.mark.parametrize("kind", KERNELS)
def test_posterior_is_the_dense_one(kind: str) -> None:
    mean, spread = posterior(kind, X, Y, AT).predict(kind, ASKED / AT.lengthscales)
    expected_mean, expected_spread = dense(kind)
    np.testing.assert_allclose(mean, expected_mean, atol=1e-6)
    np.testing.assert_allclose(spread, expected_spread, rtol=1e-6)


def test_many_rows_in_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    frozen, asked = posterior("rbf", X, Y, AT), ASKED / AT.lengthscales
    whole = frozen.predict("rbf", asked)
    monkeypatch.setattr("pyroshock.training.gp.posterior._CHUNK", 2)
    parts = frozen.predict("rbf", asked)
    np.testing.assert_allclose(parts[0], whole[0], atol=1e-12)
    np.testing.assert_allclose(parts[1], whole[1], atol=1e-12)


def test_nothing_known_far_away() -> None:
    mean, spread = posterior("rbf", X, Y, AT).predict("rbf", np.full((1, 3), 1e3))
    np.testing.assert_allclose(mean, 0.0, atol=1e-12)
    np.testing.assert_allclose(spread[0] ** 2, (AT.b + AT.sigma).diagonal(), rtol=1e-9)
