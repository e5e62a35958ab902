"""One output's Gaussian process with a basis in its mean, as a GPyTorch model.

Constraints and priors of the coregional models' parameters, as GPyTorch holds them.

Lengthscales and variances are learned as logarithms, within bounds that the optimiser keeps.
"""

from __future__ import annotations

import math
from typing import Any

import gpytorch
import numpy as np
import torch
from gpytorch.constraints import Interval
from gpytorch.kernels import LinearKernel, MaternKernel, RQKernel, ScaleKernel
from gpytorch.priors import NormalPrior

from ...array_types import Floats
from .kernel_description import SquaredExponential
from .kernels import kernel_named

#: Of standardised outputs: variances below are rounding, above are no signal's.
LEAST_VARIANCE, MOST_VARIANCE = 1e-6, 1e2
#: Of standardised predictors. What changes faster is the scatter of repetitions, which shares the
#: speed's by chance: without a floor the outputs' common scatter is learned as a law of the speed.
LEAST_LENGTHSCALE, MOST_LENGTHSCALE = 0.3, 1e3
MOST_LOADING = 10.0


class LogInterval(Interval):  # type: ignore[misc]  # GPyTorch publishes no types
    """Between two positive bounds; the raw parameter is the logarithm. The optimiser keeps the
    bounds."""

    def __init__(self, lower: Any, upper: Any) -> None:
        super().__init__(lower, upper, transform=torch.exp, inv_transform=torch.log)
        self.lower_bound = torch.as_tensor(lower, dtype=torch.float64)
        self.upper_bound = torch.as_tensor(upper, dtype=torch.float64)

    def transform(self, tensor: torch.Tensor) -> torch.Tensor:
        """The parameter of a raw one."""
        return tensor.exp()

    def inverse_transform(self, transformed_tensor: torch.Tensor) -> torch.Tensor:
        """The raw parameter of one within the bounds."""
        return transformed_tensor.log()


def variance_interval() -> LogInterval:
    """The bounds of a variance of standardised outputs."""
    return LogInterval(LEAST_VARIANCE, MOST_VARIANCE)


def within(interval: Interval, values: Floats) -> torch.Tensor:
    """Values inside the bounds of a `LogInterval`. Learned ones may lie on a bound, and their
    logarithm beyond it by rounding."""
    margin = 1e-12
    return torch.as_tensor(values).clamp(
        interval.lower_bound * (1 + margin), interval.upper_bound * (1 - margin)
    )


def lengthscale_interval() -> LogInterval:
    """The bounds of a lengthscale of standardised predictors."""
    return LogInterval(LEAST_LENGTHSCALE, MOST_LENGTHSCALE)


def log_lengthscale_prior(predictors: int) -> NormalPrior:
    """Of the logarithm of a lengthscale: about 4 sqrt(d), wide.

    Hvarfner et al. 2024, "Vanilla Bayesian optimization performs great in high dimensions",
    equation 8. It lets predictors that tell nothing fade out, and keeps predictors that never
    varied where they are.
    """
    return _normal(math.sqrt(2.0) + 0.5 * math.log(predictors), math.sqrt(3.0))


def log_variance_prior() -> NormalPrior:
    """Of the logarithm of a variance: wide, only against running off."""
    return _normal(math.log(1e-2), 4.0)


def loading_prior() -> NormalPrior:
    """Of an element of W in B = W W' + diag(kappa)."""
    return _normal(0.0, 1.0)


def _normal(mean: float, deviation: float) -> NormalPrior:
    """In float64: GPyTorch makes single precision of plain numbers."""
    return NormalPrior(*(torch.tensor(number, dtype=torch.float64) for number in (mean, deviation)))


#: How far a lengthscale may go from where it starts, as a factor: down, up.
_REACH = (math.exp(-5.0), math.exp(7.0))
#: Bounds of the signal's standard deviation, and the greatest one of the noise; the output's is 1.
_SIGNAL, _MOST_NOISE = (1e-2, 1e2), 2.0


class BasisProcess(gpytorch.models.ExactGP):  # type: ignore[misc]  # GPyTorch publishes no types
    """y (n,) at z (n x d) with basis terms h (n x p): covariance signal^2 k(z, z') + prior h h' +
    noise^2 I.

    `kind` names the kernel; `lengthscales` (d,) or (1,) is where they start, one for all where
    there is a single one. `signal` and `noise` are standard deviations; the noise keeps above
    `noise_floor`. In float64.
    """

    def __init__(
        self,
        z: Floats,
        h: Floats,
        y: Floats,
        kind: str,
        lengthscales: Floats,
        signal: float,
        noise: float,
        noise_floor: float,
        prior: float,
    ) -> None:
        likelihood = gpytorch.likelihoods.GaussianLikelihood(
            noise_constraint=LogInterval(noise_floor**2, _MOST_NOISE**2)
        )
        super().__init__(torch.tensor(np.hstack([z, h])), torch.tensor(y), likelihood)
        d, p = z.shape[1], h.shape[1]
        kernel_named(kind)
        several = {"ard_num_dims": d} if len(lengthscales) > 1 else {}
        active = {"active_dims": tuple(range(d)), **several}
        kernel = {  # type: ignore[no-untyped-call]
            "rbf": lambda: SquaredExponential(**active),
            "matern32": lambda: MaternKernel(nu=1.5, **active),
            "matern52": lambda: MaternKernel(nu=2.5, **active),
            "rational-quadratic": lambda: RQKernel(**active),
        }[kind]()
        if kind == "rational-quadratic":
            kernel.alpha = 1.0
            kernel.raw_alpha.requires_grad_(False)
        self.mean_module = gpytorch.means.ZeroMean()
        self.scaled_kernel = ScaleKernel(kernel)
        self.basis_kernel = LinearKernel(active_dims=tuple(range(d, d + p))) if p else None
        self.double()
        kernel.register_constraint(
            "raw_lengthscale",
            LogInterval(_REACH[0] * lengthscales[None], _REACH[1] * lengthscales[None]),
        )
        kernel.lengthscale = torch.as_tensor(lengthscales)[None]
        self.scaled_kernel.register_constraint(
            "raw_outputscale", LogInterval(_SIGNAL[0] ** 2, _SIGNAL[1] ** 2)
        )
        self.scaled_kernel.outputscale = within(
            self.scaled_kernel.raw_outputscale_constraint, np.array(signal**2)
        )
        if self.basis_kernel is not None:
            self.basis_kernel.variance = torch.tensor(prior, dtype=torch.float64)
            self.basis_kernel.raw_variance.requires_grad_(False)
        likelihood.noise = within(likelihood.noise_covar.raw_noise_constraint, np.array(noise**2))
        self.train()

    def forward(self, x: torch.Tensor) -> Any:
        """The prior at rows of z and h side by side."""
        covariance = self.scaled_kernel(x)
        if self.basis_kernel is not None:
            covariance = covariance + self.basis_kernel(x)
        return gpytorch.distributions.MultivariateNormal(self.mean_module(x), covariance)

    @property
    def lengthscales(self) -> Floats:
        """(d,) or (1,)."""
        return (
            np.asarray(self.scaled_kernel.base_kernel.lengthscale.detach().numpy()).ravel().copy()
        )

    @property
    def signal(self) -> float:
        """Standard deviation."""
        return float(self.scaled_kernel.outputscale.detach().sqrt())

    @property
    def noise(self) -> float:
        """Standard deviation of one measurement."""
        return float(self.likelihood.noise.detach().sqrt())
