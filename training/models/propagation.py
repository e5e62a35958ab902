"""Spreads of several coupled outputs through a function of them, to first order."""

from __future__ import annotations

import numpy as np

from ...dataset.table import Floats


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
