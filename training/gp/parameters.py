"""What a coregional Gaussian process tunes, as one vector and back."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from .kernels import Floats
from .kronecker import Likelihood

#: Of standardised outputs: variances below are rounding, above are no signal's.
LEAST_VARIANCE, MOST_VARIANCE = 1e-6, 1e2
#: Of standardised predictors. What changes faster is the scatter of repetitions, which shares the speed's by chance:
#: without a floor the outputs' common scatter is learned as a law of the speed.
LEAST_LENGTHSCALE, MOST_LENGTHSCALE = 0.3, 1e3
MOST_LOADING = 10.0


@dataclass(frozen=True, eq=False)
class Parameters:
    """K by `log_lengthscales` (d,); B = W W' + diag(kappa), W = `loadings` (m x rank); Sigma = diag(noise).
    `log_kappa` and `log_noise` (m,) are variances.
    """

    log_lengthscales: Floats
    loadings: Floats
    log_kappa: Floats
    log_noise: Floats

    @property
    def lengthscales(self) -> Floats:
        return np.exp(self.log_lengthscales)

    @property
    def b(self) -> Floats:
        return np.asarray(self.loadings @ self.loadings.T + np.diag(np.exp(self.log_kappa)))

    @property
    def sigma(self) -> Floats:
        return np.diag(np.exp(self.log_noise))

    def vector(self) -> Floats:
        return np.concatenate([getattr(self, f.name).ravel() for f in fields(self)])

    def like(self, vector: Floats) -> Parameters:
        """Of the same shapes."""
        parts, begin = {}, 0
        for f in fields(self):
            old = getattr(self, f.name)
            parts[f.name] = vector[begin : begin + old.size].reshape(old.shape)
            begin += old.size
        return Parameters(**parts)

    def chained(self, found: Likelihood, by_lengthscales: Floats) -> Parameters:
        """Derivatives by each parameter from those by B, Sigma and the lengthscales' logarithms."""
        return Parameters(
            by_lengthscales,
            2.0 * found.by_b @ self.loadings,
            found.by_b.diagonal() * np.exp(self.log_kappa),
            found.by_sigma.diagonal() * np.exp(self.log_noise),
        )

    def bounds(self) -> list[tuple[float, float]]:
        """In the vector's order."""
        variance = tuple(np.log([LEAST_VARIANCE, MOST_VARIANCE]))
        lengthscale = tuple(np.log([LEAST_LENGTHSCALE, MOST_LENGTHSCALE]))
        loading = (-MOST_LOADING, MOST_LOADING)
        return [
            *[lengthscale] * self.log_lengthscales.size,
            *[loading] * self.loadings.size,
            *[variance] * self.log_kappa.size,
            *[variance] * self.log_noise.size,
        ]


def penalty(at: Parameters) -> tuple[float, Parameters]:
    """Negative logarithm of the prior, up to a constant, and its derivatives.

    Lengthscales are log-normal about 4 sqrt(d), wide: Hvarfner et al. 2024, "Vanilla Bayesian optimization performs
    great in high dimensions", equation 8 and BoTorch's default. It lets predictors that tell nothing fade out and keeps
    predictors that never varied where they are. The others are only kept from running off.
    """
    d = at.log_lengthscales.size
    deviations = Parameters(
        (at.log_lengthscales - np.sqrt(2.0) - 0.5 * np.log(d)) / 3.0,
        at.loadings,
        (at.log_kappa - np.log(1e-2)) / 16.0,
        (at.log_noise - np.log(1e-2)) / 16.0,
    )
    weights = (3.0, 1.0, 16.0, 16.0)
    value = sum(
        0.5 * weight * float((getattr(deviations, f.name) ** 2).sum())
        for f, weight in zip(fields(at), weights, strict=True)
    )
    return value, deviations


def started(predictors: int, outputs: int, rank: int) -> Parameters:
    """Where a search begins: outputs that share nothing yet. Loadings of 0 alone would stay there, a saddle."""
    return Parameters(
        np.full(predictors, np.log(3.0)),
        0.3 * np.eye(outputs, min(rank, outputs)),
        np.full(outputs, np.log(0.5)),
        np.full(outputs, np.log(0.3)),
    )
