"""One output's Gaussian process with a basis in its mean: covariance, training by GPyTorch, leave-fold-out means.

The mean is a basis h(x) times coefficients with a wide normal prior, so it is part of the covariance (Rasmussen and
Williams 2006, section 2.7): K = signal^2 k(z, z') + PRIOR h h' + noise^2 I.

Glossary: `z` (n x d) centred predictors, `h` (n x p) basis terms, `y` (n,) the standardised output.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from ..gp.kernels import kernel_matrix

#: Prior variance of a coefficient of the basis; the output's own is 1.
PRIOR = 10.0


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
        """Lower Cholesky factor (n x n) of the measurements' covariance. Raises `ValueError` where there is none."""
        k = self.between(z, h, z, h)
        k.flat[:: len(k) + 1] += self.noise**2
        try:
            return np.asarray(np.linalg.cholesky(k), dtype=np.float64)
        except np.linalg.LinAlgError:
            name = self.kernel
            raise ValueError(f"the covariance of kernel {name!r} is not positive definite: raise the noise") from None


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


def most_likely(
    start: Process, z: Floats, h: Floats, y: Floats, ard: bool, noise_floor: float, iterations: int
) -> tuple[Process, Floats]:
    """The process of greatest marginal likelihood near `start`, and the losses of the search per row.

    Without `ard`, lengthscales stay equal; the noise's standard deviation keeps above `noise_floor`. Raises
    `ValueError` where the covariance is not positive definite.
    """
    from ..gp.basis_process import BasisProcess
    from ..gp.marginal_likelihood import CholeskyMarginalLogLikelihood
    from ..gp.maximise import maximise

    model = BasisProcess(
        z, h, y, start.kernel, start.lengthscales if ard else start.lengthscales[:1], start.signal,
        max(start.noise, noise_floor), noise_floor, PRIOR,
    )  # fmt: skip
    search = maximise(CholeskyMarginalLogLikelihood(model.likelihood, model), iterations, change=2.2e-9, gradient=1e-5)
    lengthscales = np.broadcast_to(model.lengthscales, z.shape[1]).copy()
    return Process(start.kernel, lengthscales, model.signal, model.noise), search.losses
