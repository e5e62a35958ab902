"""What of a record rests before and after its shock, and at which level."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .levels import ShockSpan

#: Fewer samples than this before or after the shock give no level.
MIN_REST_SAMPLES = 16
#: The standard error of a level comes from the means of ten blocks, which ringing and slow wander spread as they
#: should; with nine degrees of freedom five of them are exceeded by chance once in 1350 (Student's t).
BLOCKS = 10
#: A slope beyond so many of its own standard errors is a flank (Student's t, eight degrees: once in 950).
MIN_SLOPE_ERRORS = 5.0


def rest_before(x: NDArray[np.float64], span: ShockSpan) -> NDArray[np.float64]:
    """What rests before the shock in `x` (n,): the first half of what lies before it; empty where that is too little,
    and where it climbs or falls.

    The second half may hold the foot of a slow pulse, which is no level: a drop table's makes one of 1 % of the peak.
    Where a record begins inside of that foot, the first half climbs as well.
    """
    quiet = x[: span.first // 2]
    return quiet[:0] if quiet.size < MIN_REST_SAMPLES or _climbs(quiet) else quiet


def _climbs(x: NDArray[np.float64]) -> bool:
    """Whether a line through the block means of `x` (n,), n >= 10, has a slope that is no chance."""
    means = block_means(x)
    at = np.arange(BLOCKS) - (BLOCKS - 1) / 2
    slope = float(at @ means) / float(at @ at)
    residuals = means - means.mean() - slope * at
    return abs(slope) > MIN_SLOPE_ERRORS * float(np.sqrt(residuals @ residuals / (BLOCKS - 2) / (at @ at)))


def rest_after(x: NDArray[np.float64], span: ShockSpan) -> NDArray[np.float64]:
    """What rests after the shock in `x` (n,), without the falling foot of a pulse: half as much as the shock lasted,
    but half of what is left at most. Where it rings to the end, the last quarter of what follows its begin."""
    quarter = x.size - (x.size - span.first) // 4
    foot = min((span.last - span.first + 1) // 2, (x.size - span.last - 1) // 2)
    quiet = x[min(span.last + 1 + foot, quarter) :]
    return quiet if quiet.size >= MIN_REST_SAMPLES else quiet[:0]


def block_mean(x: NDArray[np.float64]) -> tuple[float, float]:
    """Mean and its standard error by batch means, of as much of `x` (n,), n >= 10, as ten equal blocks hold."""
    means = block_means(x)
    return float(means.mean()), float(means.std(ddof=1)) / BLOCKS**0.5


def block_means(x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Means of the last ten equal blocks of `x` (n,), n >= 10: (10,)."""
    length = x.size // BLOCKS
    return np.asarray(x[x.size - BLOCKS * length :].reshape(BLOCKS, length).mean(axis=1))
