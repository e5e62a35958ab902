"""What a fitted coregional Gaussian process predicts, frozen into plain arrays."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...array_types import Floats
from .kernels import Covariance
from .kronecker import TOLERANCE, factorise, solve, whiten

#: Rows that are predicted at once: keeps the memory of many below that of training.
_CHUNK = 4096


@dataclass(frozen=True, eq=False)
class Posterior:
    """m outputs given their measurements, through the r rows `pivots` (r x d) that carry the
    kernel's factor; the rest of the rows adds less than the factor's tolerance.

    With features h = k(x, pivots) `projection` (r x r), the mean is h `weights` (r x m);
    independent outputs have the variances `s` (p,) times that of the input where nothing is known
    and h^2 `remaining` (r x p) within the features, and `mixing` (p x m) takes them to the measured
    ones. `noise` (m,) are the variances of one measurement.
    """

    pivots: Floats
    projection: Floats
    weights: Floats
    s: Floats
    remaining: Floats
    mixing: Floats
    noise: Floats

    def predict(self, covariance: Covariance, z: Floats) -> tuple[Floats, Floats]:
        """Means and standard deviations (n, m) of new measurements.

        Parameters:
            covariance: The kernel over inputs that the outputs were learned with.
            z: Inputs (n, d), scaled as those that the outputs were learned at.
        """
        parts = [
            self._predict(covariance, z[begin : begin + _CHUNK])
            for begin in range(0, max(len(z), 1), _CHUNK)
        ]
        return np.concatenate([mean for mean, _ in parts]), np.concatenate(
            [spread for _, spread in parts]
        )

    def turned(self, turn: Floats) -> Posterior:
        """What the same process predicts of combinations of the outputs, whose noise becomes
        correlated.

        Parameters:
            turn: The weights (m, q) of the m outputs in each of q combinations.
        """
        weights, mixing, noise = self.weights @ turn, self.mixing @ turn, self.noise @ turn**2
        return replace(self, weights=weights, mixing=mixing, noise=noise)

    def _predict(self, covariance: Covariance, z: Floats) -> tuple[Floats, Floats]:
        h = covariance.matrix(z, self.pivots) @ self.projection
        mean = h @ self.weights
        h *= h
        # a sum of positive terms: k(x, x) - k(x, X) (...) k(X, x) would lose its digits where the
        # noise is small
        unknown = np.maximum(covariance.variances(z)[:, None] - h.sum(axis=1, keepdims=True), 0.0)
        latent = (unknown * self.s + h @ self.remaining) @ self.mixing**2
        return mean, np.sqrt(latent + self.noise)


def posterior(covariance: Covariance, z: Floats, y: Floats, b: Floats, noise: Floats) -> Posterior:
    """The outputs given their measurements; only solves, tunes nothing.

    Parameters:
        covariance: The kernel over inputs, such as a `NamedCovariance`.
        z: Inputs (n, d), as the covariance takes them.
        y: The measured outputs (n, m), less their prior mean.
        b: The covariance B (m, m) between outputs.
        noise: The variance (m,) of one measurement of each output.
    """
    from scipy.linalg import solve_triangular

    k = covariance.matrix(z, z)
    factor = factorise(k, TOLERANCE * max(float(k.diagonal().max()), 1e-300))
    white = whiten(y, b, np.diag(noise))
    _, projected, shrink = solve(factor, white)
    mixing = np.linalg.inv(white.q).astype(np.float64)
    return Posterior(
        pivots=z[factor.pivots],
        projection=solve_triangular(factor.lower, factor.basis, lower=True, trans="T"),
        weights=(projected * white.s) @ mixing,
        s=white.s,
        remaining=white.s * shrink,
        mixing=mixing,
        noise=noise.copy(),
    )
