"""Spreads of several coupled outputs through a function of them, to first order."""

from __future__ import annotations

import numpy as np

from ...array_types import Floats


def residual_correlation(residual: Floats) -> Floats:
    """Correlation m x m of one measurement's deviations (n x m): regressions give each output's spread alone, yet
    the deviations of one pulse go together. Outputs that never deviate are correlated with none.
    """
    centred = residual - residual.mean(axis=0)
    width = np.sqrt((centred * centred).mean(axis=0))
    scaled = centred / np.where(width > 0, width, np.inf)
    correlation = np.asarray(scaled.T @ scaled / len(residual))
    np.fill_diagonal(correlation, 1.0)
    return correlation


def propagated(jacobian: Floats, spread: Floats, correlation: Floats) -> Floats:
    """Standard deviations (n x p) of p functions with derivatives `jacobian` (n x p x m) of m outputs that have the
    standard deviations `spread` (n x m) and the correlation m x m.
    """
    parts = jacobian * spread[:, None, :]
    variance = np.einsum("npm,npm->np", parts @ correlation, parts)
    return np.asarray(np.sqrt(np.maximum(variance, 0.0)))


def correlation_with(jacobian: Floats, spread: Floats, correlation: Floats, output: int) -> Floats:
    """Correlation (n,) of a function with derivatives `jacobian` (n x m), as in `propagated`, with one of its outputs;
    0 where either has no spread."""
    parts = jacobian * spread
    variance = np.einsum("nm,nm->n", parts @ correlation, parts)
    together = parts @ correlation[:, output]
    width = np.sqrt(np.maximum(variance, 0.0))
    scaled = (width > 0) & (spread[:, output] > 0)
    return np.asarray(np.clip(np.divide(together, width, out=np.zeros_like(width), where=scaled), -1.0, 1.0))
