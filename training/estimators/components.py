"""Outputs as principal components: uncorrelated columns of unit variance."""

from __future__ import annotations

import numpy as np

from ...array_types import Floats

#: Components of less variance, relative to the largest, are rounding.
LEAST_VARIANCE = 1e-8


def principal(y: Floats) -> Floats:
    """Turn (p x m) that makes y (n x m, standardised) from its p components, p at least 1.

    Repetitions scatter in amplitude: all outputs together. As noise of each output by itself that cannot be said, and a
    coregional process learns it as a law of the speed, with lengthscales near nothing. Between components, the noise
    is nearly uncorrelated; the likelihood is also better conditioned (a fifth of the steps).
    """
    variances, directions = np.linalg.eigh(y.T @ y / len(y))
    kept = variances > LEAST_VARIANCE * variances[-1]
    kept[-1] = True
    variances, directions = variances[kept][::-1], directions[:, kept][:, ::-1]
    return np.asarray((directions * np.sqrt(np.where(variances > 0, variances, 1.0))).T)


def unturned(y: Floats, turn: Floats) -> Floats:
    """Components (n x p) of y (n x m); the rows of `turn` are orthogonal."""
    return np.asarray(y @ (turn / (turn * turn).sum(axis=1, keepdims=True)).T)
