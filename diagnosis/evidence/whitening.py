"""A covariance as its Cholesky factor."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

#: Added to the diagonal, in tolerances squared: no simulator is better than a seventh of its tolerance anywhere. An
#: observable that hardly scatters would otherwise decide alone which background there is.
_LEAST = 0.02
#: Directions that add less than the square of this to a variance of one add nothing.
_NOTHING = 1e-3


@dataclass(frozen=True, eq=False)
class Whitening:
    """A covariance C = L L' of N cells: `white(x)` is L^-1 x, `log_norm` the logarithm of the density's constant."""

    lower: Floats
    log_norm: float

    @classmethod
    def of(cls, covariance: Floats) -> Self:
        from scipy.linalg import cholesky

        lower = cholesky(covariance + _LEAST * np.eye(len(covariance)), lower=True, check_finite=False)
        half = float(np.log(np.diag(lower)).sum())
        return cls(lower, -half - 0.5 * len(covariance) * float(np.log(2 * np.pi)))

    def white(self, values: Floats) -> Floats:
        """Of (N,) or (N, m)."""
        from scipy.linalg import solve_triangular

        return np.asarray(solve_triangular(self.lower, values, lower=True, check_finite=False))

    @cached_property
    def inverse(self) -> Floats:
        """(N, N): L^-1."""
        return self.white(np.eye(len(self.lower)))

    def opened(self, directions: Floats) -> Opened:
        """With U U' added to C, U (N, q)."""
        turned, sizes, _ = np.linalg.svd(self.white(directions), full_matrices=False)
        kept = sizes > _NOTHING
        grown = np.sqrt(1.0 + sizes[kept] ** 2)
        return Opened(self.lower, self.log_norm - float(np.log(grown).sum()), turned[:, kept], 1.0 - 1.0 / grown)

    def log_density(self, z: Floats) -> float:
        zw = self.white(z)
        return self.log_norm - 0.5 * float(zw @ zw)


@dataclass(frozen=True, eq=False)
class Opened(Whitening):
    """C + U U' by the factor of C: what C whitens is shortened by `less` (q,) along `along` (N, q), orthonormal."""

    along: Floats
    less: Floats

    def white(self, values: Floats) -> Floats:
        """Of (N,) or (N, m)."""
        return self.shortened(super().white(values))

    def shortened(self, white: Floats) -> Floats:
        """Of what C has whitened already, (N,) or (N, m)."""
        return np.asarray(white - (self.along * self.less) @ (self.along.T @ white))
