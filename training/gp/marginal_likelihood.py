"""Exact marginal likelihoods of GPyTorch's models with derivatives in closed form.

That of several outputs does without their n m x n m covariance.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import torch
from gpytorch.mlls import ExactMarginalLogLikelihood
from linear_operator.operators import KroneckerProductLinearOperator
from linear_operator.utils.cholesky import psd_safe_cholesky
from linear_operator.utils.errors import NanError, NotPSDError

from ...array_types import Floats
from .kronecker import TOLERANCE, Likelihood, factorise, likelihood

#: Most that the factorisation may change the loss per value of y, by the rigorous bound (rarely a
#: thousandth of it).
TRUNCATION = 1e-6
#: Below, what is left of the kernel's variance is rounding.
LEAST_TOLERANCE = 1e-15


# GPyTorch publishes no types
class KroneckerMarginalLogLikelihood(ExactMarginalLogLikelihood):  # type: ignore[misc]
    """What `ExactMarginalLogLikelihood` gives for a `MultitaskKernel`, priors included, with its
    gradient.

    Value and gradient are those of `kronecker.likelihood`: eigendecompositions of r x r and m x m,
    r the numerical rank of the kernel matrix, in place of one Cholesky factor of n m x n m. The
    likelihood is a `MultitaskGaussianLikelihood` of any rank; everything is float64.
    `truncation_bound` is the most by which the last value, before priors, can differ from the
    untruncated one.
    """

    truncation_bound: float = float("nan")

    def forward(self, function_dist: Any, target: torch.Tensor, *params: Any) -> torch.Tensor:
        """The logarithm of the marginal likelihood, per value of the outputs.

        Parameters:
            function_dist: The prior distribution of the outputs, as the model gives it.
            target: The outputs (n, m) in float64.
            params: What the model's added loss terms are called with, where it has such terms.

        Raises:
            ValueError: Where the covariance is no product of two, or the target not float64.
        """
        covariance = function_dist.lazy_covariance_matrix
        covariance = (
            covariance.evaluate_kernel() if hasattr(covariance, "evaluate_kernel") else covariance
        )
        if (
            not isinstance(covariance, KroneckerProductLinearOperator)
            or len(covariance.linear_ops) != 2
        ):
            raise ValueError(
                f"a covariance of inputs times one of outputs is needed "
                f"(MultitaskKernel), not {covariance}"
            )
        _require_float64(target)
        k, b = (part.to_dense() for part in covariance.linear_ops)
        value, bound = _ExactLikelihood.apply(
            k, b, _noise(self.likelihood), target - function_dist.mean
        )
        self.truncation_bound = float(bound)
        total: torch.Tensor = self._add_other_terms(-value, params)
        return total / target.numel()


def _noise(noise_likelihood: Any) -> torch.Tensor:
    """Sigma (m x m)."""
    diagonal = noise_likelihood.rank == 0
    sigma: torch.Tensor = (
        torch.diag(noise_likelihood.task_noises) if diagonal else noise_likelihood.task_noise_covar
    )
    if noise_likelihood.has_global_noise:
        sigma = sigma + noise_likelihood.noise * torch.eye(len(sigma), dtype=sigma.dtype)
    return sigma


def exact_likelihood(k: Floats, y: Floats, b: Floats, sigma: Floats) -> Likelihood:
    """The marginal likelihood with K factorised until `TRUNCATION` is kept, as far as rounding
    allows.

    Parameters:
        k: The kernel matrix K (n, n) between inputs.
        y: The outputs (n, m), less their prior mean.
        b: The covariance B (m, m) between outputs.
        sigma: The covariance Sigma (m, m) of the noise of one measurement.
    """
    scale = max(float(k.diagonal().max()), 1e-300)
    tolerance = TOLERANCE
    result = likelihood(factorise(k, tolerance * scale), y, b, sigma)
    while result.bound > TRUNCATION * y.size and tolerance > LEAST_TOLERANCE:
        tolerance = max(tolerance / 100, LEAST_TOLERANCE)
        result = likelihood(factorise(k, tolerance * scale), y, b, sigma)
    return result


class _ExactLikelihood(torch.autograd.Function):  # type: ignore[misc]  # of PyTorch's untyped part
    """Negative log likelihood of K, B, Sigma and y, and its bound; the derivatives are known as
    soon as it is."""

    @staticmethod
    def forward(ctx: Any, *tensors: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """The value and the bound of the truncation, both scalars."""
        k, b, sigma, y = (tensor.detach().numpy() for tensor in tensors)
        result = exact_likelihood(k, y, b, sigma)
        parts = (result.by_k, result.by_b, result.by_sigma, result.by_y)
        ctx.save_for_backward(*(torch.from_numpy(np.ascontiguousarray(part)) for part in parts))
        bound = tensors[0].new_tensor(result.bound)
        ctx.mark_non_differentiable(bound)
        return tensors[0].new_tensor(result.value), bound

    @staticmethod
    def backward(ctx: Any, *gradients: torch.Tensor) -> Any:
        """By K, B, Sigma and y."""
        return tuple(gradients[0] * part for part in ctx.saved_tensors)


# GPyTorch publishes no types
class CholeskyMarginalLogLikelihood(ExactMarginalLogLikelihood):  # type: ignore[misc]
    """What `ExactMarginalLogLikelihood` gives for a model of one output, priors included, with its
    gradient.

    With K + Sigma = L L', alpha = (K + Sigma)^-1 (y - mean) and v the negative logarithm, dv/dK =
    1/2 ((K + Sigma)^-1 - alpha alpha') and dv/dmean = -alpha (Rasmussen and Williams 2006, equation
    5.9). Automatic differentiation of the factorisation solves for n x n numbers twice more. The
    likelihood is a `GaussianLikelihood`; everything is float64.
    """

    def forward(self, function_dist: Any, target: torch.Tensor, *params: Any) -> torch.Tensor:
        """The logarithm of the marginal likelihood, per value of the output.

        Parameters:
            function_dist: The prior distribution of the output, as the model gives it.
            target: The output (n,) in float64.
            params: What the model's added loss terms are called with, where it has such terms.

        Raises:
            ValueError: Where the target is not one output in float64, and where the covariance is
                not positive definite, not even with the jitter of `gpytorch.settings`.
        """
        if target.dim() != 1 or function_dist.mean.shape != target.shape:
            shapes = f"{tuple(target.shape)} with a mean of {tuple(function_dist.mean.shape)}"
            raise ValueError(f"the likelihood is that of one output (n,), y is {shapes}")
        _require_float64(target)
        noise = self.likelihood.noise.expand(len(target))
        value = _CholeskyLikelihood.apply(
            function_dist.covariance_matrix, noise, target - function_dist.mean
        )
        total: torch.Tensor = self._add_other_terms(-value, params)
        return total / len(target)


# of PyTorch's untyped part
class _CholeskyLikelihood(torch.autograd.Function):  # type: ignore[misc]
    """Negative log likelihood of K (n x n), the noise's variances (n,) and y (n,) without its
    mean."""

    @staticmethod
    def forward(ctx: Any, k: torch.Tensor, noise: torch.Tensor, y: torch.Tensor) -> torch.Tensor:
        """The value; the derivatives are kept."""
        covariance = k.clone()
        covariance.diagonal().add_(noise)
        try:
            lower = psd_safe_cholesky(covariance)
        except (NotPSDError, NanError) as error:
            raise ValueError(
                f"the covariance is not positive definite, raise the noise: {error}"
            ) from error
        alpha = torch.cholesky_solve(y[:, None], lower)[:, 0]
        by_k = torch.cholesky_inverse(lower).addr_(alpha, alpha, alpha=-1.0).mul_(0.5)
        ctx.save_for_backward(by_k, alpha)
        return 0.5 * (y @ alpha + len(y) * math.log(2.0 * math.pi)) + lower.diagonal().log().sum()

    @staticmethod
    def backward(ctx: Any, *gradients: torch.Tensor) -> Any:
        """By K, the noise and y."""
        by_k, alpha = ctx.saved_tensors
        return gradients[0] * by_k, gradients[0] * by_k.diagonal(), gradients[0] * alpha


def _require_float64(target: torch.Tensor) -> None:
    if target.dtype != torch.float64:
        raise ValueError(
            f"the likelihood is computed in float64, y is {target.dtype}: "
            f"make model and data .double()"
        )
