"""One output's Gaussian process with a basis in its mean, as a GPyTorch model."""

from __future__ import annotations

import math
from typing import Any

import gpytorch
import numpy as np
import torch
from gpytorch.kernels import LinearKernel, MaternKernel, RQKernel, ScaleKernel

from ...array_types import Floats
from .kernel_description import SquaredExponential
from .kernels import kernel_named
from .priors import LogInterval

#: How far a lengthscale may go from where it starts, as a factor: down, up.
_REACH = (math.exp(-5.0), math.exp(7.0))
#: Bounds of the signal's standard deviation, and the greatest one of the noise; the output's is 1.
_SIGNAL, _MOST_NOISE = (1e-2, 1e2), 2.0


class BasisProcess(gpytorch.models.ExactGP):  # type: ignore[misc]  # GPyTorch publishes no types
    """y (n,) at z (n x d) with basis terms h (n x p): covariance signal^2 k(z, z') + prior h h' + noise^2 I.

    `kind` names the kernel; `lengthscales` (d,) or (1,) is where they start, one for all where there is a single one.
    `signal` and `noise` are standard deviations; the noise keeps above `noise_floor`. In float64.
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
            "raw_lengthscale", LogInterval(_REACH[0] * lengthscales[None], _REACH[1] * lengthscales[None])
        )
        kernel.lengthscale = torch.as_tensor(lengthscales)[None]
        self.scaled_kernel.register_constraint("raw_outputscale", LogInterval(_SIGNAL[0] ** 2, _SIGNAL[1] ** 2))
        self.scaled_kernel.outputscale = torch.tensor(signal**2, dtype=torch.float64)
        if self.basis_kernel is not None:
            self.basis_kernel.variance = torch.tensor(prior, dtype=torch.float64)
            self.basis_kernel.raw_variance.requires_grad_(False)
        likelihood.noise = torch.tensor(noise**2, dtype=torch.float64)
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
        return np.asarray(self.scaled_kernel.base_kernel.lengthscale.detach().numpy()).ravel().copy()

    @property
    def signal(self) -> float:
        """Standard deviation."""
        return float(self.scaled_kernel.outputscale.detach().sqrt())

    @property
    def noise(self) -> float:
        """Standard deviation of one measurement."""
        return float(self.likelihood.noise.detach().sqrt())
