"""Predictions against the dense formulas."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from pyroshock.training.gp.kernels import KERNELS, NamedCovariance, TorchCovariance, kernel_matrix
from pyroshock.training.gp.posterior import Posterior, posterior

Floats = NDArray[np.float64]
RNG = np.random.default_rng(11)
X, Y, ASKED = RNG.normal(size=(40, 3)), RNG.normal(size=(40, 4)), RNG.normal(size=(7, 3))
LENGTHSCALES, NOISE = np.array([2.0, 3.0, 1.5]), np.array([0.1, 0.01, 1e-4, 0.3])
LOADINGS = 0.7 * RNG.normal(size=(4, 2))
COVARIANCE_OF_OUTPUTS = LOADINGS @ LOADINGS.T + np.diag(np.exp(RNG.normal(-3, 1, 4)))


def frozen(kind: str) -> Posterior:
    return posterior(NamedCovariance(kind, LENGTHSCALES), X, Y, COVARIANCE_OF_OUTPUTS, NOISE)


def dense(kind: str) -> tuple[Floats, Floats]:
    """Rasmussen and Williams 2006, equations 2.25 and 2.26, on the whole covariance; noise
    included."""
    a, asked = X / LENGTHSCALES, ASKED / LENGTHSCALES
    covariance = np.kron(kernel_matrix(kind, a, a), COVARIANCE_OF_OUTPUTS) + np.kron(
        np.eye(40), np.diag(NOISE)
    )
    across = np.kron(kernel_matrix(kind, asked, a), COVARIANCE_OF_OUTPUTS)
    solved = np.linalg.solve(covariance, np.column_stack([Y.ravel(), across.T]))
    prior = np.kron(np.eye(7), COVARIANCE_OF_OUTPUTS + np.diag(NOISE)).diagonal()
    variance = prior - np.einsum("ij,ji->i", across, solved[:, 1:])
    return (across @ solved[:, 0]).reshape(7, 4), np.sqrt(variance).reshape(7, 4)


@pytest.mark.parametrize("kind", KERNELS)
def test_posterior_is_the_dense_one(kind: str) -> None:
    mean, spread = frozen(kind).predict(NamedCovariance(kind, LENGTHSCALES), ASKED)
    expected_mean, expected_spread = dense(kind)
    np.testing.assert_allclose(mean, expected_mean, atol=1e-6)
    np.testing.assert_allclose(spread, expected_spread, rtol=1e-6)


def test_many_rows_in_parts_and_nothing_known_far_away(monkeypatch: pytest.MonkeyPatch) -> None:
    known, covariance = frozen("rbf"), NamedCovariance("rbf", LENGTHSCALES)
    whole = known.predict(covariance, ASKED)
    monkeypatch.setattr("pyroshock.training.gp.posterior._CHUNK", 2)
    parts = known.predict(covariance, ASKED)
    np.testing.assert_allclose(parts[0], whole[0], atol=1e-12)
    np.testing.assert_allclose(parts[1], whole[1], atol=1e-12)
    mean, spread = frozen("rbf").predict(NamedCovariance("rbf", LENGTHSCALES), np.full((1, 3), 1e5))
    np.testing.assert_allclose(mean, 0.0, atol=1e-12)
    np.testing.assert_allclose(
        spread[0] ** 2, (COVARIANCE_OF_OUTPUTS + np.diag(NOISE)).diagonal(), rtol=1e-9
    )


def test_a_kernel_of_gpytorch_predicts_as_gpytorch_does() -> None:
    """A sum of kernels whose variance is not 1, beside an exact GPyTorch model of one output."""
    import gpytorch
    import torch

    kernels = gpytorch.kernels
    kernel = (kernels.ScaleKernel(kernels.RBFKernel()) + kernels.LinearKernel()).double()
    likelihood = gpytorch.likelihoods.GaussianLikelihood().double()
    likelihood.noise = 0.05

    class Peer(gpytorch.models.ExactGP):  # type: ignore[misc]
        def __init__(self) -> None:
            super().__init__(torch.tensor(X), torch.tensor(Y[:, 0]), likelihood)
            self.mean_module, self.covar_module = gpytorch.means.ZeroMean(), kernel

        def forward(self, x):
            return gpytorch.distributions.MultivariateNormal(
                self.mean_module(x), self.covar_module(x)
            )

    peer = Peer().double().eval()
    likelihood.eval()
    with torch.no_grad(), gpytorch.settings.fast_computations(False, False, False):
        theirs = likelihood(peer(torch.tensor(ASKED)))
    covariance = TorchCovariance(kernel)
    ours = posterior(covariance, X, Y[:, :1], np.eye(1), np.array([0.05])).predict(
        covariance, ASKED
    )
    np.testing.assert_allclose(ours[0][:, 0], theirs.mean.numpy(), atol=1e-6)
    np.testing.assert_allclose(ours[1][:, 0], theirs.stddev.numpy(), atol=1e-6)
