"""One output's Gaussian process, exact: covariance, marginal likelihood with gradient, leave-fold-out means.

The mean is a basis h(x) times coefficients with a wide normal prior, so it is part of the covariance (Rasmussen and
Williams 2006, section 2.7): K = signal^2 k(z, z') + PRIOR h h' + noise^2 I.

Glossary: `z` (n x d) centred predictors, `h` (n x p) basis terms, `y` (n,) the standardised output.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..gp.kernels import kernel_and_slope, kernel_matrix, lengthscale_gradient
from .base import Floats

#: Prior variance of a coefficient of the basis; the output's own is 1.
PRIOR = 10.0

#: How far a lengthscale may go from where it starts, as a factor: down, up.
_REACH = (np.exp(-5.0), np.exp(7.0))


@dataclass(frozen=True, eq=False)
class Process:
    """`lengthscales` (d,) in the units of z; `signal` and `noise` are standard deviations, the output's being 1."""

    kernel: str
    lengthscales: Floats
    signal: float
    noise: float

    def between(self, z: Floats, h: Floats, other_z: Floats, other_h: Floats) -> Floats:
        """Covariance n x p of the noise-free output at two sets of inputs."""
        k = kernel_matrix(self.kernel, z / self.lengthscales, other_z / self.lengthscales)
        return np.asarray(self.signal**2 * k + PRIOR * h @ other_h.T)

    def factor(self, z: Floats, h: Floats) -> Floats:
        """Lower Cholesky factor (n x n) of the measurements' covariance."""
        k = self.between(z, h, z, h)
        k.flat[:: len(k) + 1] += self.noise**2
        return _cholesky(k, self.kernel)


def _cholesky(k: Floats, kernel: str) -> Floats:
    try:
        return np.asarray(np.linalg.cholesky(k), dtype=np.float64)
    except np.linalg.LinAlgError:
        raise ValueError(f"the covariance of kernel {kernel!r} is not positive definite: raise the noise") from None


def inverse(lower: Floats) -> Floats:
    """K^-1 from its lower Cholesky factor, both triangles."""
    from scipy.linalg.lapack import dpotri

    k, _ = dpotri(lower, lower=1)
    half = np.tril(k)
    return np.asarray(half + np.tril(half, -1).T)


def leave_folds_out(inverted: Floats, y: Floats, folds: Sequence[NDArray[np.bool_]]) -> Floats:
    """Means (n,) of each fold's rows as the other rows alone predict them: y_F - (K^-1_FF)^-1 (K^-1 y)_F."""
    weights = inverted @ y
    means = np.empty_like(y)
    for rows in folds:
        means[rows] = y[rows] - np.linalg.solve(inverted[np.ix_(rows, rows)], weights[rows])
    return means


def likelihood(process: Process, z: Floats, h: Floats, y: Floats) -> tuple[float, Floats]:
    """Negative logarithm of the marginal likelihood without its constant, and its derivatives (d + 2,) by the
    logarithms of lengthscales, signal and noise.
    """
    scaled = z / process.lengthscales
    k, slope = kernel_and_slope(process.kernel, scaled)
    covariance = process.signal**2 * k + PRIOR * h @ h.T
    covariance.flat[:: len(y) + 1] += process.noise**2
    lower = _cholesky(covariance, process.kernel)
    by_k = inverse(lower)
    weights = by_k @ y
    value = 0.5 * float(y @ weights) + float(np.log(lower.diagonal()).sum())
    by_k -= np.outer(weights, weights)
    by_k *= 0.5 * process.signal**2
    by_noise = 2.0 * process.noise**2 / process.signal**2 * float(by_k.trace())
    by_signal = 2.0 * float((by_k * k).sum())
    return value, np.array([*lengthscale_gradient(scaled, by_k * slope), by_signal, by_noise])


def most_likely(
    start: Process, z: Floats, h: Floats, y: Floats, ard: bool, noise_floor: float, iterations: int
) -> Process:
    """The process of greatest marginal likelihood near `start` (L-BFGS-B); without `ard`, lengthscales stay equal."""
    from scipy.optimize import minimize

    d = z.shape[1]
    free = d if ard else 1

    def process_at(theta: Floats) -> Process:
        lengthscales = np.exp(theta[:free]) if ard else np.full(d, np.exp(theta[0]))
        return Process(start.kernel, lengthscales, float(np.exp(theta[-2])), float(np.exp(theta[-1])))

    def loss(theta: Floats) -> tuple[float, Floats]:
        value, slopes = likelihood(process_at(theta), z, h, y)
        lengths = slopes[:d] if ard else slopes[:d].sum(keepdims=True)
        return value / len(y), np.concatenate([lengths, slopes[d:]]) / len(y)

    first = np.log([*start.lengthscales[:free], start.signal, max(start.noise, noise_floor)])
    low, high = np.log(_REACH)
    bounds = [(float(value + low), float(value + high)) for value in first[:free]]
    bounds += [(np.log(1e-2), np.log(1e2)), (np.log(noise_floor), np.log(2.0))]
    found = minimize(loss, first, jac=True, bounds=bounds, method="L-BFGS-B", options={"maxiter": iterations})
    return process_at(found.x)
