"""Our marginal likelihoods in the place of GPyTorch's: values, gradients, priors, of several
outputs and of one."""

from __future__ import annotations

import math
from typing import Any

import gpytorch
import numpy as np
import pytest
import torch
from gpytorch.mlls import ExactMarginalLogLikelihood
from gpytorch.models import ExactGP
from linear_operator.utils.warnings import NumericalWarning
from pyroshock.training.gp.basis_process import BasisProcess
from pyroshock.training.gp.kronecker import factorise, likelihood
from pyroshock.training.gp.marginal_likelihood import (
    TRUNCATION,
    CholeskyMarginalLogLikelihood,
    KroneckerMarginalLogLikelihood,
    _CholeskyLikelihood,
    _ExactLikelihood,
    exact_likelihood,
)
from pyroshock.training.gp.maximise import exactly, maximise
from pyroshock.training.gp.multitask import CoregionalModel, named_kernel
from scipy.stats import gamma, multivariate_normal, norm

RNG = np.random.default_rng(12)
X, Y = RNG.normal(size=(30, 3)), RNG.normal(size=(30, 4))
X[20:] = X[:10]  # repetitions: singular kernel matrices
ONE_OUTPUT = np.random.default_rng(21)
Z = ONE_OUTPUT.normal(size=(40, 3))
H = np.hstack([np.ones((40, 1)), Z])
T = np.sin(Z[:, 0]) + 0.3 * Z[:, 1] + 0.1 * ONE_OUTPUT.normal(size=40)
KERNEL_NAMES = pytest.mark.parametrize(
    "kind", ["rbf", "matern32", "matern52", "rational-quadratic"]
)


def coregional_model(kind: str = "rbf") -> CoregionalModel:
    rng = np.random.default_rng(13)
    model = CoregionalModel(X, Y, named_kernel(kind, 3), rank=2)
    numbers = (
        0.7 * rng.normal(size=(4, 2)),
        np.exp(rng.normal(-3, 1, 4)),
        np.exp(rng.normal(-2, 1, 4)),
    )
    model.set_parameters(np.array([2.0, 3.0, 1.5]), *numbers)
    return model


class PriorProcess(ExactGP):  # type: ignore[misc]  # GPyTorch publishes no types
    """A constant mean, a kernel with a prior and a noise with another, all of them learned."""

    def __init__(self, z: np.ndarray = Z, y: np.ndarray = T, noise: float = 0.05) -> None:
        super().__init__(
            torch.tensor(z), torch.tensor(y), gpytorch.likelihoods.GaussianLikelihood()
        )
        self.mean_module = gpytorch.means.LinearMean(z.shape[1])
        self.covar_module = gpytorch.kernels.ScaleKernel(
            gpytorch.kernels.MaternKernel(nu=2.5, ard_num_dims=z.shape[1])
        )
        self.double()
        prior = gpytorch.priors.GammaPrior(torch.tensor(3.0).double(), torch.tensor(2.0).double())
        self.covar_module.base_kernel.register_prior("lengthscale_prior", prior, "lengthscale")
        normal = gpytorch.priors.NormalPrior(
            torch.tensor(-2.0).double(), torch.tensor(1.5).double()
        )
        self.likelihood.register_prior("log_noise_prior", normal, lambda module: module.noise.log())
        self.mean_module.weights.data = torch.tensor([[0.2], [-0.1], [0.4]]).double()
        self.likelihood.noise_covar.register_constraint(
            "raw_noise", gpytorch.constraints.Positive()
        )
        self.likelihood.noise = noise

    def forward(self, x: Any) -> Any:
        return gpytorch.distributions.MultivariateNormal(self.mean_module(x), self.covar_module(x))


def basis_process(kind: str, ard: bool = True) -> BasisProcess:
    lengthscales = np.array([0.7, 1.5, 3.0]) if ard else np.array([1.5])
    return BasisProcess(Z, H, T, kind, lengthscales, 1.3, 0.2, 0.01, 10.0)


def value_and_gradients(likelihood: Any, model: Any) -> tuple[float, dict[str, np.ndarray]]:
    """The objective and its derivatives by each raw parameter that is learned."""
    model.zero_grad()
    with exactly():
        value = likelihood(model.likelihood, model)(model(*model.train_inputs), model.train_targets)
        value.backward()
    return value.item(), {
        name: p.grad.numpy().copy() for name, p in model.named_parameters() if p.requires_grad
    }


def assert_same_as_gpytorch(
    likelihood: Any, model: Any, rtol: float, atol: float
) -> dict[str, np.ndarray]:
    """The slopes, of which value and gradient are GPyTorch's, priors included."""
    value, slopes = value_and_gradients(likelihood, model)
    expected, expected_slopes = value_and_gradients(ExactMarginalLogLikelihood, model)
    assert value == pytest.approx(expected, abs=1e-8)
    assert slopes.keys() == expected_slopes.keys()
    for name, slope in slopes.items():
        np.testing.assert_allclose(slope, expected_slopes[name], rtol=rtol, atol=atol)
    return slopes


@KERNEL_NAMES
def test_value_and_gradient_are_gpytorchs_priors_included(kind: str) -> None:
    assert (
        len(
            assert_same_as_gpytorch(
                KroneckerMarginalLogLikelihood, coregional_model(kind), 1e-6, 1e-7
            )
        )
        == 4
    )
    for ard in (True, False):
        slopes = assert_same_as_gpytorch(
            CholeskyMarginalLogLikelihood, basis_process(kind, ard), 1e-8, 1e-8
        )
        assert len(slopes) == 3 and all(np.abs(slope).max() > 1e-4 for slope in slopes.values())


def test_priors_are_the_documented_ones() -> None:
    """Hvarfner et al.: the logarithm of a lengthscale is normal about sqrt(2) + log(d) / 2 with
    deviation sqrt(3)."""
    model = coregional_model()
    total, _ = value_and_gradients(KroneckerMarginalLogLikelihood, model)
    bare = -exact_likelihood(
        model.kernel(*model.train_inputs).to_dense().detach().numpy(), Y,
        model.loadings @ model.loadings.T + np.diag(model.kappa), np.diag(model.noise),
    ).value  # fmt: skip
    scales = np.log(model.kernel.lengthscale.detach().numpy())
    prior = (
        norm.logpdf(scales, np.sqrt(2) + 0.5 * np.log(3), np.sqrt(3)).sum()
        + norm.logpdf(model.loadings).sum()
    )
    prior += norm.logpdf(np.log([model.kappa, model.noise]), np.log(1e-2), 4).sum()
    assert total * Y.size == pytest.approx(bare + prior, abs=1e-8)


def test_mean_kernel_noise_and_priors_have_gpytorchs_gradients() -> None:
    slopes = assert_same_as_gpytorch(CholeskyMarginalLogLikelihood, PriorProcess(), 1e-8, 1e-8)
    assert {name.partition(".")[0] for name in slopes} == {
        "likelihood",
        "mean_module",
        "covar_module",
    }
    model = PriorProcess()
    value, _ = value_and_gradients(CholeskyMarginalLogLikelihood, model)
    covariance = model.covar_module(torch.tensor(Z)).to_dense().detach().numpy() + 0.05 * np.eye(40)
    mean = model.mean_module(torch.tensor(Z)).detach().numpy()
    density = multivariate_normal.logpdf(T, mean, covariance)
    lengthscales = model.covar_module.base_kernel.lengthscale.detach().numpy()
    priors = gamma.logpdf(lengthscales, 3.0, scale=0.5).sum() + norm.logpdf(
        math.log(0.05), -2.0, 1.5
    )
    assert value * 40 == pytest.approx(density + priors, abs=1e-7)


def test_gradient_checks() -> None:
    """PyTorch's own check of a function against its gradient, all arguments."""

    def several(k: Any, b: Any, sigma: Any, y: Any) -> Any:
        return _ExactLikelihood.apply(k @ k.T, b @ b.T, sigma @ sigma.T, y)[0]

    def single(factor: Any, noise: Any, y: Any) -> Any:
        return _CholeskyLikelihood.apply(factor @ factor.T, noise.exp(), y)

    for symmetric, shapes in (
        (several, ((5, 5), (3, 3), (3, 3), (5, 3))),
        (single, ((6, 6), (6,), (6,))),
    ):
        arguments = [torch.tensor(RNG.normal(size=shape), requires_grad=True) for shape in shapes]
        assert torch.autograd.gradcheck(symmetric, arguments)


def test_maximise_gains_and_keeps_bounds() -> None:
    model = coregional_model()
    search = maximise(KroneckerMarginalLogLikelihood(model.likelihood, model), 60)
    assert (
        search.losses[-1] < search.losses[0] - 0.05
        and search.truncation_bound < TRUNCATION * Y.size
    )
    scales = model.kernel.lengthscale.detach().numpy()
    assert np.all(scales >= 0.3 - 1e-12) and np.all(scales <= 1e3 + 1e-9)
    assert np.all(model.noise >= 1e-6 * (1 - 1e-12))


def test_maximise_ends_where_pytorchs_own_optimiser_does() -> None:
    ours, theirs = coregional_model(), coregional_model()
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


def test_training_takes_the_same_steps() -> None:
    models = [basis_process("matern52"), basis_process("matern52")]
    likelihoods = (CholeskyMarginalLogLikelihood, ExactMarginalLogLikelihood)
    ours, theirs = (
        maximise(kind(model.likelihood, model), 10)
        for kind, model in zip(likelihoods, models, strict=True)
    )
    np.testing.assert_allclose(ours.losses, theirs.losses, atol=1e-8)


def test_repeated_rows_without_noise_get_jitter() -> None:
    """As GPyTorch's own, which warns of it."""
    model = PriorProcess(np.vstack([Z, Z]), np.hstack([T, T]), noise=1e-17)
    with pytest.warns(NumericalWarning, match="jitter"):
        value, _ = value_and_gradients(CholeskyMarginalLogLikelihood, model)
    with pytest.warns(NumericalWarning, match="jitter"):
        expected, _ = value_and_gradients(ExactMarginalLogLikelihood, model)
    assert value == pytest.approx(expected, rel=1e-6)


def test_a_coarse_factor_is_refined() -> None:
    k = np.exp(-0.5 * ((X[:, None] - X[None]) ** 2).sum(-1) / 9)
    result = exact_likelihood(k, 1e3 * Y, np.eye(4), 1e-4 * np.eye(4))
    finest = likelihood(factorise(k, 1e-15), 1e3 * Y, np.eye(4), 1e-4 * np.eye(4))
    assert result.bound <= max(TRUNCATION * Y.size, finest.bound)


def test_correlated_noise_of_gpytorch() -> None:
    model = coregional_model()
    torch.manual_seed(0)
    noise = gpytorch.likelihoods.MultitaskGaussianLikelihood(num_tasks=4, rank=2).double()
    with exactly():
        prior, y = model(*model.train_inputs), model.train_targets
        kinds = (KroneckerMarginalLogLikelihood, ExactMarginalLogLikelihood)
        ours, theirs = (kind(noise, model)(prior, y).item() for kind in kinds)
    assert ours == pytest.approx(theirs, abs=1e-6)


def test_what_is_no_covariance_is_named() -> None:
    k = torch.diag(torch.tensor([1.0, -1.0, 1.0]).double())
    with (
        pytest.warns(NumericalWarning),
        pytest.raises(ValueError, match="not positive definite, raise the noise"),
    ):
        _CholeskyLikelihood.apply(k, torch.full((3,), 1e-3).double(), torch.ones(3).double())
    with pytest.raises(ValueError, match=r"not positive definite.*NaN"):
        _CholeskyLikelihood.apply(
            k * float("nan"), torch.full((3,), 1e-3).double(), torch.ones(3).double()
        )


def test_what_a_likelihood_cannot_take_is_named() -> None:
    model = coregional_model()
    plain = gpytorch.distributions.MultitaskMultivariateNormal(torch.zeros(30, 4), torch.eye(120))
    with pytest.raises(ValueError, match="MultitaskKernel"):
        KroneckerMarginalLogLikelihood(model.likelihood, model)(plain, model.train_targets)
    single = basis_process("rbf")
    for kind, process in (
        (KroneckerMarginalLogLikelihood, model),
        (CholeskyMarginalLogLikelihood, single),
    ):
        with pytest.raises(ValueError, match=r"float32.*double"):
            kind(process.likelihood, process)(
                process(*process.train_inputs), process.train_targets.float()
            )
    with pytest.raises(ValueError, match=r"one output.*\(40, 2\)"):
        CholeskyMarginalLogLikelihood(single.likelihood, single)(
            single(*single.train_inputs), torch.ones(40, 2).double()
        )
