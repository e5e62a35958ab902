"""Constraints and priors of the coregional models' parameters, as GPyTorch holds them.

Lengthscales and variances are learned as logarithms, within bounds that the optimiser keeps.
"""

from __future__ import annotations

import math
from typing import Any

import torch
from gpytorch.constraints import Interval
from gpytorch.priors import NormalPrior

#: Of standardised outputs: variances below are rounding, above are no signal's.
LEAST_VARIANCE, MOST_VARIANCE = 1e-6, 1e2
#: Of standardised predictors. What changes faster is the scatter of repetitions, which shares the speed's by chance:
#: without a floor the outputs' common scatter is learned as a law of the speed.
LEAST_LENGTHSCALE, MOST_LENGTHSCALE = 0.3, 1e3
MOST_LOADING = 10.0


class LogInterval(Interval):  # type: ignore[misc]  # GPyTorch publishes no types
    """Between two positive bounds; the raw parameter is the logarithm. The optimiser keeps the bounds."""

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


def lengthscale_interval() -> LogInterval:
    """The bounds of a lengthscale of standardised predictors."""
    return LogInterval(LEAST_LENGTHSCALE, MOST_LENGTHSCALE)


def log_lengthscale_prior(predictors: int) -> NormalPrior:
    """Of the logarithm of a lengthscale: about 4 sqrt(d), wide.

    Hvarfner et al. 2024, "Vanilla Bayesian optimization performs great in high dimensions", equation 8. It lets
    predictors that tell nothing fade out, and keeps predictors that never varied where they are.
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
