"""GPyTorch's own likelihood and gradient, and ours given to it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from pyroshock.training.gp.gpytorch_bridge import log_likelihood, multitask_model, set_parameters
from pyroshock.training.gp.parameters import Parameters
from pyroshock.training.gp.search import evaluate

torch = pytest.importorskip("torch", reason="the extra [models] is not installed")
gpytorch = pytest.importorskip("gpytorch", reason="the extra [models] is not installed")

RNG = np.random.default_rng(12)
X, Y = RNG.normal(size=(30, 3)), RNG.normal(size=(30, 4))
X[20:] = X[:10]  # repetitions: singular kernel matrices
AT = Parameters(np.log([2.0, 3.0, 1.5]), 0.7 * RNG.normal(size=(4, 2)), RNG.normal(-3, 1, 4), RNG.normal(-2, 1, 4))


def model_at() -> tuple[Any, Any, Any, Any]:
    x, y = torch.tensor(X), torch.tensor(Y)
    model, likelihood = multitask_model(x, y, rank=2)
    set_parameters(model, likelihood, AT)
    return model, likelihood, x, y


def gradients(model: Any) -> dict[str, Any]:
    """By name; the likelihood's are the model's too."""
    return {name: one.grad.clone() for name, one in model.named_parameters()}


def test_same_loss_as_the_search() -> None:
    model, likelihood, x, y = model_at()
    found, _ = evaluate("rbf", X, Y, AT)
    assert -log_likelihood(likelihood, model(x), y).item() * Y.size == pytest.approx(found.value, abs=1e-9)


def test_same_gradient_as_the_search() -> None:
    model, likelihood, x, y = model_at()
    _, found = evaluate("rbf", X, Y, AT)
    (-log_likelihood(likelihood, model(x), y) * y.numel()).backward()
    loadings = model.covar_module.task_covar_module.covar_factor.grad.numpy()
    np.testing.assert_allclose(loadings, found.loadings, rtol=1e-9, atol=1e-9)


def test_same_loss_and_gradient_as_gpytorch() -> None:
    model, likelihood, x, y = model_at()
    ours = log_likelihood(likelihood, model(x), y)
    ours.backward()
    found = gradients(model)
    model.zero_grad()
    peer = gpytorch.mlls.ExactMarginalLogLikelihood(likelihood, model)
    with gpytorch.settings.fast_computations(log_prob=False, covar_root_decomposition=False):
        theirs = peer(model(x), y)
        theirs.backward()
    assert ours.item() == pytest.approx(theirs.item(), abs=1e-6)
    for name, gradient in gradients(model).items():
        np.testing.assert_allclose(found[name].numpy(), gradient.numpy(), rtol=1e-5, atol=1e-6)


def test_gradient_checks() -> None:
    """PyTorch's own check of a function against its gradient, all four arguments."""
    from pyroshock.training.gp.gpytorch_bridge import _function

    def symmetric(k: Any, b: Any, sigma: Any, y: Any) -> Any:
        return _function().apply(k @ k.T, b @ b.T, sigma @ sigma.T, y, 1e-14)

    factors = [torch.tensor(RNG.normal(size=shape), requires_grad=True) for shape in ((5, 5), (3, 3), (3, 3), (5, 3))]
    assert torch.autograd.gradcheck(symmetric, factors)


def test_trained_by_gpytorchs_parameters() -> None:
    model, likelihood, x, y = model_at()
    optimiser = torch.optim.Adam(model.parameters(), lr=0.1)
    losses = []
    for _ in range(10):
        optimiser.zero_grad()
        loss = -log_likelihood(likelihood, model(x), y)
        loss.backward()
        optimiser.step()
        losses.append(loss.item())
    assert losses[-1] < losses[0] - 0.05


def test_correlated_noise_of_gpytorch() -> None:
    model, _, x, y = model_at()
    torch.manual_seed(0)
    noise = gpytorch.likelihoods.MultitaskGaussianLikelihood(num_tasks=4, rank=2).double()
    peer = gpytorch.mlls.ExactMarginalLogLikelihood(noise, model)
    with gpytorch.settings.fast_computations(log_prob=False, covar_root_decomposition=False):
        assert log_likelihood(noise, model(x), y).item() == pytest.approx(peer(model(x), y).item(), abs=1e-6)


def test_other_covariances() -> None:
    _, likelihood, _, y = model_at()
    plain = gpytorch.distributions.MultitaskMultivariateNormal(torch.zeros(30, 4), torch.eye(120))
    with pytest.raises(ValueError, match="MultitaskKernel"):
        log_likelihood(likelihood, plain, y)


def test_single_precision() -> None:
    model, likelihood, x, y = model_at()
    with pytest.raises(ValueError, match=r"float32.*double"):
        log_likelihood(likelihood, model(x), y.float())
