"""The coregional Gaussian process as a GPyTorch model."""

from __future__ import annotations

from typing import Any

import gpytorch
import numpy as np
import torch
from gpytorch.kernels import Kernel, MaternKernel, MultitaskKernel, RQKernel

from ...array_types import Floats
from .basis_process import (
    MOST_LOADING,
    lengthscale_interval,
    loading_prior,
    log_lengthscale_prior,
    log_variance_prior,
    variance_interval,
    within,
)
from .kernel_description import SquaredExponential
from .kernels import kernel_named

#: Where a search begins, in standardised columns.
_LENGTHSCALE, _KAPPA, _NOISE, _LOADING = 3.0, 0.5, 0.3, 0.3


def named_kernel(kind: str, predictors: int) -> Kernel:
    """A kernel of GPyTorch with a lengthscale for each predictor, its bounds and its prior.

    Parameters:
        kind: The name of the kernel in `kernels.KERNELS`, such as "rbf".
        predictors: The number of predictors.

    Raises:
        LookupError: For an unknown kernel, with the names that there are.
    """
    kernel_named(kind)
    made = {  # type: ignore[no-untyped-call]
        "rbf": lambda: SquaredExponential(ard_num_dims=predictors),
        "matern32": lambda: MaternKernel(nu=1.5, ard_num_dims=predictors),
        "matern52": lambda: MaternKernel(nu=2.5, ard_num_dims=predictors),
        "rational-quadratic": lambda: _rational_quadratic(predictors),
    }[kind]()
    kernel = made.double()
    kernel.register_constraint("raw_lengthscale", lengthscale_interval())
    kernel.lengthscale = _LENGTHSCALE
    prior = log_lengthscale_prior(predictors)
    kernel.register_prior("log_lengthscale_prior", prior, lambda module: module.lengthscale.log())
    return kernel


def _rational_quadratic(predictors: int) -> RQKernel:
    """With the mixture parameter 1, which is not learned."""
    kernel = RQKernel(ard_num_dims=predictors)
    kernel.alpha = 1.0
    kernel.raw_alpha.requires_grad_(False)
    return kernel


class CoregionalModel(gpytorch.models.ExactGP):  # type: ignore[misc]  # GPyTorch publishes no types
    """Outputs y (n x m) at x (n x d), both standardised, in float64: zero mean, covariance B (x) K
    + D (x) I.

    K is that of `kernel`, B = W W' + diag(kappa) an `IndexKernel` of `rank` columns, D the noise of
    each output.
    """

    def __init__(self, x: Floats, y: Floats, kernel: Kernel, rank: int) -> None:
        outputs = y.shape[1]
        likelihood = gpytorch.likelihoods.MultitaskGaussianLikelihood(
            num_tasks=outputs, rank=0, has_global_noise=False, noise_constraint=variance_interval()
        )
        super().__init__(torch.tensor(x), torch.tensor(y), likelihood)
        self.mean_module = gpytorch.means.MultitaskMean(
            gpytorch.means.ZeroMean(), num_tasks=outputs
        )
        self.covar_module = MultitaskKernel(kernel, num_tasks=outputs, rank=min(rank, outputs))
        self.double()
        index = self.covar_module.task_covar_module
        index.register_constraint("raw_var", variance_interval())
        unlimited = gpytorch.constraints.Interval(-MOST_LOADING, MOST_LOADING, transform=None)
        index.register_constraint("covar_factor", unlimited)
        index.register_prior("loading_prior", loading_prior(), lambda module: module.covar_factor)
        index.register_prior("log_var_prior", log_variance_prior(), lambda module: module.var.log())
        likelihood.register_prior(
            "log_noise_prior", log_variance_prior(), lambda module: module.task_noises.log()
        )
        # Outputs that share nothing yet. Loadings of 0 alone would stay there: a saddle.
        index.covar_factor.data = _LOADING * torch.eye(
            outputs, min(rank, outputs), dtype=torch.float64
        )
        index.var = torch.full((outputs,), _KAPPA, dtype=torch.float64)
        likelihood.task_noises = torch.full((outputs,), _NOISE, dtype=torch.float64)
        self.train()

    def forward(self, x: torch.Tensor) -> Any:
        """The prior distribution of the outputs.

        Parameters:
            x: Standardised predictors (n, d).
        """
        return gpytorch.distributions.MultitaskMultivariateNormal(
            self.mean_module(x), self.covar_module(x)
        )

    @property
    def kernel(self) -> Kernel:
        """Of the inputs."""
        return self.covar_module.data_covar_module

    @property
    def loadings(self) -> Floats:
        """W (m x rank)."""
        return _numbers(self.covar_module.task_covar_module.covar_factor)

    @property
    def kappa(self) -> Floats:
        """Variances (m,) of each output alone."""
        return _numbers(self.covar_module.task_covar_module.var)

    @property
    def noise(self) -> Floats:
        """Variances (m,) of one measurement."""
        return _numbers(self.likelihood.task_noises)

    def set_parameters(
        self, lengthscales: Floats, loadings: Floats, kappa: Floats, noise: Floats
    ) -> None:
        """Set the parameters of a model with a named kernel.

        Parameters:
            lengthscales: The lengthscale (d,) of each standardised predictor.
            loadings: W (m, rank) of the covariance B between outputs.
            kappa: The variance (m,) of each output alone.
            noise: The variance (m,) of one measurement of each output.
        """
        self.kernel.lengthscale = within(lengthscale_interval(), lengthscales)
        self.set_outputs(loadings, kappa, noise)

    def set_outputs(self, loadings: Floats, kappa: Floats, noise: Floats) -> None:
        """Set the parameters between outputs, whatever the kernel.

        Parameters:
            loadings: W (m, rank) of the covariance B between outputs.
            kappa: The variance (m,) of each output alone.
            noise: The variance (m,) of one measurement of each output.
        """
        index = self.covar_module.task_covar_module
        index.covar_factor.data = torch.tensor(loadings)
        index.var = within(variance_interval(), kappa)
        self.likelihood.task_noises = within(variance_interval(), noise)


def _numbers(tensor: torch.Tensor) -> Floats:
    return np.array(tensor.detach().numpy(), dtype=np.float64)
