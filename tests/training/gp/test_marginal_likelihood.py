"""GPyTorch's own marginal likelihood, and ours in its place: values, gradients, priors."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="the extra [models] is not installed")
gpytorch = pytest.importorskip("gpytorch", reason="the extra [models] is not installed")

from pyroshock.training.gp.kronecker import coregional_likelihood  # noqa: E402
from pyroshock.training.gp.marginal_likelihood import (  # noqa: E402
    TRUNCATION,
    KroneckerMarginalLogLikelihood,
    _ExactLikelihood,
    exact_likelihood,
)
from pyroshock.training.gp.maximise import exactly, maximise  # noqa: E402
from pyroshock.training.gp.multitask import CoregionalModel, named_kernel  # noqa: E402

RNG = np.random.default_rng(12)
X, Y = RNG.normal(size=(30, 3)), RNG.normal(size=(30, 4))
X[20:] = X[:10]  # repetitions: singular kernel matrices


def model_at(kind: str = "rbf", kernel: Any = None) -> CoregionalModel:
    rng = np.random.default_rng(13)
    model = CoregionalModel(X, Y, kernel or named_kernel(kind, 3), rank=2)
    numbers = (0.7 * rng.normal(size=(4, 2)), np.exp(rng.normal(-3, 1, 4)), np.exp(rng.normal(-2, 1, 4)))
    model.set_parameters(np.array([2.0, 3.0, 1.5]), *numbers) if kernel is None else None
    return model


def value_and_gradients(objective: Any) -> tuple[float, dict[str, Any]]:
    """The likelihood and its derivatives by each raw parameter that is learned."""
    model = objective.model
    model.zero_grad()
    with exactly():
        value = objective(model(*model.train_inputs), model.train_targets)
        value.backward()
    return value.item(), {name: p.grad.numpy().copy() for name, p in model.named_parameters() if p.requires_grad}


@pytest.mark.parametrize("kind", ["rbf", "matern32", "matern52", "rational-quadratic"])
def test_value_and_gradient_are_gpytorchs_priors_included(kind: str) -> None:
    model = model_at(kind)
    ours, our_slopes = value_and_gradients(KroneckerMarginalLogLikelihood(model.likelihood, model))
    theirs, their_slopes = value_and_gradients(gpytorch.mlls.ExactMarginalLogLikelihood(model.likelihood, model))
    assert ours == pytest.approx(theirs, abs=1e-8)
    assert set(our_slopes) == set(their_slopes) and len(our_slopes) == 4
    for name, slope in our_slopes.items():
        np.testing.assert_allclose(slope, their_slopes[name], rtol=1e-6, atol=1e-7)


def test_priors_are_the_documented_ones() -> None:
    """Hvarfner et al.: the logarithm of a lengthscale is normal about sqrt(2) + log(d) / 2 with deviation sqrt(3)."""
    model = model_at()
    with_priors = KroneckerMarginalLogLikelihood(model.likelihood, model)
    total, _ = value_and_gradients(with_priors)
    bare = -exact_likelihood(
        model.kernel(*model.train_inputs).to_dense().detach().numpy(), Y,
        model.loadings @ model.loadings.T + np.diag(model.kappa), np.diag(model.noise),
    ).value  # fmt: skip
    from scipy.stats import norm

    scales = np.log(model.kernel.lengthscale.detach().numpy())
    prior = norm.logpdf(scales, np.sqrt(2) + 0.5 * np.log(3), np.sqrt(3)).sum() + norm.logpdf(model.loadings).sum()
    prior += norm.logpdf(np.log([model.kappa, model.noise]), np.log(1e-2), 4).sum()
    assert total * Y.size == pytest.approx(bare + prior, abs=1e-8)


def test_gradient_checks() -> None:
    """PyTorch's own check of a function against its gradient, all four arguments."""

    def symmetric(k: Any, b: Any, sigma: Any, y: Any) -> Any:
        return _ExactLikelihood.apply(k @ k.T, b @ b.T, sigma @ sigma.T, y)[0]

    factors = [torch.tensor(RNG.normal(size=shape), requires_grad=True) for shape in ((5, 5), (3, 3), (3, 3), (5, 3))]
    assert torch.autograd.gradcheck(symmetric, factors)


def test_maximise_gains_and_keeps_bounds() -> None:
    model = model_at()
    search = maximise(KroneckerMarginalLogLikelihood(model.likelihood, model), 60)
    assert search.losses[-1] < search.losses[0] - 0.05 and search.truncation_bound < TRUNCATION * Y.size
    scales = model.kernel.lengthscale.detach().numpy()
    assert np.all(scales >= 0.3 - 1e-12) and np.all(scales <= 1e3 + 1e-9)
    assert np.all(model.noise >= 1e-6 * (1 - 1e-12))


def test_maximise_ends_where_pytorchs_own_optimiser_does() -> None:
    ours, theirs = model_at(), model_at()
    search = maximise(KroneckerMarginalLogLikelihood(ours.likelihood, ours), 300, change=1e-10)
    objective = KroneckerMarginalLogLikelihood(theirs.likelihood, theirs)
    optimiser = torch.optim.LBFGS(
        theirs.parameters(), max_iter=400, line_search_fn="strong_wolfe", tolerance_change=1e-10
    )

    def closure() -> Any:
        optimiser.zero_grad()
        loss = -objective(theirs(*theirs.train_inputs), theirs.train_targets)
        loss.backward()
        return loss

    with exactly():
        optimiser.step(closure)
        reached = closure().item()
    assert search.losses.min() == pytest.approx(reached, abs=2e-3)


def test_a_coarse_factor_is_refined() -> None:
    k = np.exp(-0.5 * ((X[:, None] - X[None]) ** 2).sum(-1) / 9)
    result = exact_likelihood(k, 1e3 * Y, np.eye(4), 1e-4 * np.eye(4))
    finest = coregional_likelihood(k, 1e3 * Y, np.eye(4), 1e-4 * np.eye(4), 1e-15)
    assert result.bound <= max(TRUNCATION * Y.size, finest.bound)


def test_correlated_noise_of_gpytorch() -> None:
    model = model_at()
    torch.manual_seed(0)
    noise = gpytorch.likelihoods.MultitaskGaussianLikelihood(num_tasks=4, rank=2).double()
    with exactly():
        prior, y = model(*model.train_inputs), model.train_targets
        ours, theirs = (kind(noise, model)(prior, y).item() for kind in KINDS)
    assert ours == pytest.approx(theirs, abs=1e-6)


KINDS = (KroneckerMarginalLogLikelihood, gpytorch.mlls.ExactMarginalLogLikelihood)


def test_what_it_cannot_take_is_named() -> None:
    model = model_at()
    plain = gpytorch.distributions.MultitaskMultivariateNormal(torch.zeros(30, 4), torch.eye(120))
    with pytest.raises(ValueError, match="MultitaskKernel"):
        KroneckerMarginalLogLikelihood(model.likelihood, model)(plain, model.train_targets)
    objective = KroneckerMarginalLogLikelihood(model.likelihood, model)
    with pytest.raises(ValueError, match=r"float32.*double"):
        objective(model(*model.train_inputs), model.train_targets.float())
