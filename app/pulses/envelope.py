"""A series as few points as a screen can show, without losing a peak: the least and the largest sample of each bucket.

Means or every n-th sample would show a shock too small; this shows each extreme at its own instant and exact.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

#: First, last, and the two extremes of one bucket.
FEWEST_POINTS = 4


def envelope(values: NDArray[Any], points: int) -> NDArray[np.intp]:
    """Indices, rising, of at most `points` samples of `values` (n,) that keep its outline; all where they fit.

    The first and the last sample are kept, and of every bucket (`bucket_length` consecutive samples) the first of its
    least and of its largest ones. A bucket with samples that are no numbers keeps the extremes of the others; one
    without any number keeps one sample, so that a long gap stays a gap. Raises `ValueError` below `FEWEST_POINTS`.
    """
    length = bucket_length(values.size, points)
    if length == 1:
        return np.arange(values.size, dtype=np.intp)
    whole = values.size // length
    ends = np.array([0, values.size - 1], dtype=np.intp)
    parts = [ends, *_extremes(values[: whole * length].reshape(whole, length), 0)]
    if values.size % length:
        parts += _extremes(values[whole * length :].reshape(1, -1), whole * length)
    return np.unique(np.concatenate(parts))


def bucket_length(samples: int, points: int) -> int:
    """Samples per bucket of a series of `samples` that `points` shall show; 1 where all fit."""
    if points < FEWEST_POINTS:
        raise ValueError(f"points is {points!r}; expected {FEWEST_POINTS} or more")
    return 1 if samples <= points else -(-samples // ((points - 2) // 2))


def _extremes(rows: NDArray[Any], origin: int) -> list[NDArray[np.intp]]:
    """Indices of the least and the largest of each row (k, m) of a series that begins at `origin`."""
    low = high = rows
    if np.issubdtype(rows.dtype, np.inexact) and (gaps := np.isnan(rows)).any():
        low, high = np.where(gaps, np.inf, rows), np.where(gaps, -np.inf, rows)
    starts = origin + np.arange(len(rows), dtype=np.intp) * rows.shape[1]
    return [starts + low.argmin(axis=1), starts + high.argmax(axis=1)]
