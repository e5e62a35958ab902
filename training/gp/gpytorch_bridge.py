"""The exact likelihood for GPyTorch's multitask models, which it otherwise builds and factorises at n m x n m.

    model, likelihood = multitask_model(x, y, rank=6)
    loss = -log_likelihood(likelihood, model(x), y)
    loss.backward()

`Coregional` searches without it: the same numbers through GPyTorch cost its own pass through the kernel on top.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from .kronecker import TOLERANCE, coregional_likelihood
from .parameters import Parameters

if TYPE_CHECKING:
    from torch import Tensor


def log_likelihood(likelihood: Any, output: Any, y: Tensor, tolerance: float = TOLERANCE) -> Tensor:
    """What `ExactMarginalLogLikelihood` gives, per value of y (n x m), with its gradient; priors are the caller's.

    `likelihood` is a `MultitaskGaussianLikelihood` of rank 0 or more, `output` what a model with a `MultitaskKernel`
    returns when it is trained. Raises `ValueError` where its covariance is no product of two, or not in float64.
    """
    import torch
    from linear_operator.operators import KroneckerProductLinearOperator

    covariance = output.lazy_covariance_matrix
    covariance = covariance.evaluate_kernel() if hasattr(covariance, "evaluate_kernel") else covariance
    if not isinstance(covariance, KroneckerProductLinearOperator) or len(covariance.linear_ops) != 2:
        raise ValueError(f"a covariance of inputs times one of outputs is needed (MultitaskKernel), not {covariance}")
    if y.dtype != torch.float64:
        raise ValueError(f"the likelihood is computed in float64, y is {y.dtype}: make model and data .double()")
    k, b = (part.to_dense() for part in covariance.linear_ops)
    value: Tensor = _function().apply(k, b, _noise(likelihood), y - output.mean, tolerance)
    return -value / y.numel()


def multitask_model(x: Tensor, y: Tensor, rank: int, kernel: Any = None) -> tuple[Any, Any]:
    """The coregional model as GPyTorch writes it: zero mean, `kernel` (an ARD `RBFKernel`) times an `IndexKernel` of
    `rank`, one noise per output. x (n x d) and y (n x m) are standardised, in float64. Returns model and likelihood.
    """
    import gpytorch

    m = y.shape[1]

    class Model(gpytorch.models.ExactGP):  # type: ignore[misc]
        def __init__(self) -> None:
            super().__init__(x, y, likelihood)
            self.mean_module = gpytorch.means.MultitaskMean(gpytorch.means.ZeroMean(), num_tasks=m)
            data = kernel or gpytorch.kernels.RBFKernel(ard_num_dims=x.shape[1])
            self.covar_module = gpytorch.kernels.MultitaskKernel(data, num_tasks=m, rank=rank)

        def forward(self, at: Tensor) -> Any:
            return gpytorch.distributions.MultitaskMultivariateNormal(self.mean_module(at), self.covar_module(at))

    likelihood = gpytorch.likelihoods.MultitaskGaussianLikelihood(
        num_tasks=m, rank=0, has_global_noise=False, noise_constraint=gpytorch.constraints.GreaterThan(1e-6)
    )
    return Model().double().train(), likelihood.double().train()


def set_parameters(model: Any, likelihood: Any, at: Parameters) -> None:
    """Our parameters into a `multitask_model` of the same rank: W is `covar_factor`, kappa `var`, D `task_noises`."""
    import torch

    index = model.covar_module.task_covar_module
    model.covar_module.data_covar_module.lengthscale = torch.as_tensor(at.lengthscales)
    index.covar_factor.data = torch.tensor(at.loadings)
    index.var = torch.as_tensor(np.exp(at.log_kappa))
    likelihood.task_noises = torch.as_tensor(np.exp(at.log_noise))


def _noise(likelihood: Any) -> Tensor:
    """Sigma (m x m)."""
    import torch

    sigma: Tensor = torch.diag(likelihood.task_noises) if likelihood.rank == 0 else likelihood.task_noise_covar
    if likelihood.has_global_noise:
        sigma = sigma + likelihood.noise * torch.eye(len(sigma), dtype=sigma.dtype)
    return sigma


@cache
def _function() -> Any:
    """Made on first use: the class needs torch to exist."""
    import torch

    class Exact(torch.autograd.Function):  # type: ignore[misc]
        """Negative log likelihood of K, B, Sigma and y; its derivatives are known as soon as it is."""

        @staticmethod
        def forward(ctx: Any, *arguments: Any) -> Tensor:
            *tensors, tolerance = arguments
            k, b, sigma, y = (tensor.detach().numpy() for tensor in tensors)
            found = coregional_likelihood(k, y, b, sigma, tolerance)
            parts = (found.by_k, found.by_b, found.by_sigma, found.by_y)
            ctx.save_for_backward(*(torch.from_numpy(np.ascontiguousarray(part)) for part in parts))
            return tensors[0].new_tensor(found.value)

        @staticmethod
        def backward(ctx: Any, *gradients: Any) -> Any:
            return (*(gradients[0] * part for part in ctx.saved_tensors), None)

    return Exact
