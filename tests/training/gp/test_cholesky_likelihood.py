"""The likelihood of one output against GPyTorch's own: value, derivatives, priors, refusals."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="the extra [models] is not installed")
gpytorch = pytest.importorskip("gpytorch", reason="the extra [models] is not installed")

from gpytorch.mlls import ExactMarginalLogLikelihood  # noqa: E402
from gpytorch.models import ExactGP  # noqa: E402
from linear_operator.utils.warnings import NumericalWarning  # noqa: E402
from pyroshock.training.gp.basis_process import BasisProcess  # noqa: E402
from pyroshock.training.gp.marginal_likelihood import CholeskyMarginalLogLikelihood, _CholeskyLikelihood  # noqa: E402
from pyroshock.training.gp.maximise import exactly, maximise  # noqa: E402

RNG = np.random.default_rng(21)
Z = RNG.normal(size=(40, 3))
H = np.hstack([np.ones((40, 1)), Z])
Y = np.sin(Z[:, 0]) + 0.3 * Z[:, 1] + 0.1 * RNG.normal(size=40)
KINDS = ("rbf", "matern32", "matern52", "rational-quadratic")


class PriorProcess(ExactGP):  # type: ignore[misc]  # GPyTorch publishes no types
    """A constant mean, a kernel with a prior and a noise with another, all of them learned."""

    def __init__(self, z: np.ndarray = Z, y: np.ndarray = Y, noise: float = 0.05) -> None:
        super().__init__(torch.tensor(z), torch.tensor(y), gpytorch.likelihoods.GaussianLikelihood())
        self.mean_module = gpytorch.means.LinearMean(z.shape[1])
        self.covar_module = gpytorch.kernels.ScaleKernel(gpytorch.kernels.MaternKernel(nu=2.5, ard_num_dims=z.shape[1]))
        self.double()
        prior = gpytorch.priors.GammaPrior(torch.tensor(3.0).double(), torch.tensor(2.0).double())
        self.covar_module.base_kernel.register_prior("lengthscale_prior", prior, "lengthscale")
        normal = gpytorch.priors.NormalPrior(torch.tensor(-2.0).double(), torch.tensor(1.5).double())
        self.likelihood.register_prior("log_noise_prior", normal, lambda module: module.noise.log())
        self.mean_module.weights.data = torch.tensor([[0.2], [-0.1], [0.4]]).double()
        self.likelihood.noise_covar.register_constraint("raw_noise", gpytorch.constraints.Positive())
        self.likelihood.noise = noise

    def forward(self, x: Any) -> Any:
        return gpytorch.distributions.MultivariateNormal(self.mean_module(x), self.covar_module(x))


def basis_process(kind: str, ard: bool = True) -> BasisProcess:
    lengthscales = np.array([0.7, 1.5, 3.0]) if ard else np.array([1.5])
    return BasisProcess(Z, H, Y, kind, lengthscales, 1.3, 0.2, 0.01, 10.0)


def value_and_gradients(likelihood: Any, model: Any) -> tuple[float, dict[str, np.ndarray]]:
    """The objective and its derivatives by each raw parameter that is learned."""
    model.zero_grad()
    with exactly():
        value = likelihood(model.likelihood, model)(model(*model.train_inputs), model.train_targets)
        value.backward()
    return value.item(), {name: p.grad.numpy().copy() for name, p in model.named_parameters() if p.requires_grad}


def assert_same_as_gpytorch(model: Any) -> dict[str, np.ndarray]:
    value, slopes = value_and_gradients(CholeskyMarginalLogLikelihood, model)
    expected, expected_slopes = value_and_gradients(ExactMarginalLogLikelihood, model)
    assert value == pytest.approx(expected, abs=1e-8)
    assert slopes.keys() == expected_slopes.keys()
    for name, slope in slopes.items():
        np.testing.assert_allclose(slope, expected_slopes[name], rtol=1e-8, atol=1e-8)
    return slopes


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("ard", [True, False])
def test_contact_times_likelihood_is_gpytorchs(kind: str, ard: bool) -> None:
    slopes = assert_same_as_gpytorch(basis_process(kind, ard))
    assert len(slopes) == 3 and all(np.abs(slope).max() > 1e-4 for slope in slopes.values())


def test_mean_kernel_noise_and_priors_have_gpytorchs_gradients() -> None:
    slopes = assert_same_as_gpytorch(PriorProcess())
    assert {name.partition(".")[0] for name in slopes} == {"likelihood", "mean_module", "covar_module"}
    model = PriorProcess()
    value, _ = value_and_gradients(CholeskyMarginalLogLikelihood, model)
    covariance = model.covar_module(torch.tensor(Z)).to_dense().detach().numpy() + 0.05 * np.eye(40)
    from scipy.stats import gamma, multivariate_normal, norm

    mean = model.mean_module(torch.tensor(Z)).detach().numpy()
    density = multivariate_normal.logpdf(Y, mean, covariance)
    lengthscales = model.covar_module.base_kernel.lengthscale.detach().numpy()
    priors = gamma.logpdf(lengthscales, 3.0, scale=0.5).sum() + norm.logpdf(math.log(0.05), -2.0, 1.5)
    assert value * 40 == pytest.approx(density + priors, abs=1e-7)


def test_gradient_checks() -> None:
    """PyTorch's own check of a function against its gradient, all three arguments."""

    def symmetric(factor: Any, noise: Any, y: Any) -> Any:
        return _CholeskyLikelihood.apply(factor @ factor.T, noise.exp(), y)

    arguments = [torch.tensor(RNG.normal(size=shape), requires_grad=True) for shape in ((6, 6), (6,), (6,))]
    assert torch.autograd.gradcheck(symmetric, arguments)


def test_training_takes_the_same_steps() -> None:
    models = [basis_process("matern52"), basis_process("matern52")]
    likelihoods = (CholeskyMarginalLogLikelihood, ExactMarginalLogLikelihood)
    ours, theirs = (
        maximise(kind(model.likelihood, model), 10) for kind, model in zip(likelihoods, models, strict=True)
    )
    np.testing.assert_allclose(ours.losses, theirs.losses, atol=1e-8)


def test_repeated_rows_without_noise_get_jitter() -> None:
    """As GPyTorch's own, which warns of it."""
    model = PriorProcess(np.vstack([Z, Z]), np.hstack([Y, Y]), noise=1e-17)
    with pytest.warns(NumericalWarning, match="jitter"):
        value, _ = value_and_gradients(CholeskyMarginalLogLikelihood, model)
    with pytest.warns(NumericalWarning, match="jitter"):
        expected, _ = value_and_gradients(ExactMarginalLogLikelihood, model)
    assert value == pytest.approx(expected, rel=1e-6)


def test_what_is_no_covariance_or_no_double_is_named() -> None:
    k = torch.diag(torch.tensor([1.0, -1.0, 1.0]).double())
    with (
        pytest.warns(NumericalWarning),
        pytest.raises(ValueError, match="not positive definite, raise the noise"),
    ):
        _CholeskyLikelihood.apply(k, torch.full((3,), 1e-3).double(), torch.ones(3).double())
    with pytest.raises(ValueError, match=r"not positive definite.*NaN"):
        _CholeskyLikelihood.apply(k * float("nan"), torch.full((3,), 1e-3).double(), torch.ones(3).double())
    model = basis_process("rbf")
    objective = CholeskyMarginalLogLikelihood(model.likelihood, model)
    with pytest.raises(ValueError, match=r"float32.*double"):
        objective(model(*model.train_inputs), model.train_targets.float())
    with pytest.raises(ValueError, match=r"one output.*\(40, 2\)"):
        objective(model(*model.train_inputs), torch.ones(40, 2).double())
