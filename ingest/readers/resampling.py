"""Samples at uneven times put on an even grid, where the laboratory asks for it, with the error
that this makes.

The curve through the samples is a cubic spline. Its error is bounded by how far two splines depart
from it that pass through every second sample alone: their steps are twice as long, which makes
their error up to sixteen times as large for a curve that is well sampled, and as large as the peak
for one that is not.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ...array_types import Floats
from .base import RecordingError, rate_from_step

#: Of the steps, so many may be shorter than the grid's.
_SHORTER_STEPS = 0.02
#: The grid's rate is rounded up to a number within this of it.
_ROUNDED_RATE = 5e-3
#: A step that is so many times as long as those beside it is a gap: nothing tells what was in it.
_GAP = 3.0
_FEWEST_SAMPLES = 8


def grid_rate(path: Path, times_s: Floats) -> float:
    """The rate (Hz) of the even grid for rising times (n,): of their short steps, so that nothing
    is lost.

    Raises `RecordingError` for a gap, which cannot be filled, and for fewer than eight samples.
    """
    if times_s.size < _FEWEST_SAMPLES:
        raise RecordingError(
            f"{path.name}: has {times_s.size} samples; expected {_FEWEST_SAMPLES} to resample them"
        )
    steps = np.diff(times_s)
    beside = np.maximum(np.r_[steps[1], steps[:-1]], np.r_[steps[1:], steps[-2]])
    at = int(np.argmax(steps / beside))
    if steps[at] > _GAP * beside[at]:
        raise RecordingError(
            f"{path.name}: its time is uneven and has a gap of "
            f"{steps[at]:.6g} s before sample {at + 1}, which cannot "
            "be resampled; save the parts before and after it as records of their own"
        )
    return rate_from_step(float(np.quantile(steps, _SHORTER_STEPS)), _ROUNDED_RATE)


def resampled(
    path: Path, name: str, times_s: Floats, samples: Floats, rate_hz: float
) -> tuple[Floats, float]:
    """Samples (n,) at times (n,) on the grid of `rate_hz` from the first time on (m,), and the
    bound of their error.

    Raises `RecordingError` for samples that are not finite.
    """
    from scipy.interpolate import CubicSpline

    if not np.all(np.isfinite(samples)):
        raise RecordingError(
            f"{path.name}: {name!r} has samples that are not finite; they cannot be resampled"
        )
    count = int(np.floor((times_s[-1] - times_s[0]) * rate_hz * (1.0 + 1e-12))) + 1
    grid = times_s[0] + np.arange(count) / rate_hz
    values = CubicSpline(times_s, samples)(grid)
    error = 0.0
    for first in (0, 1):
        inside = (grid >= times_s[first]) & (grid <= times_s[first::2][-1])
        coarse = CubicSpline(times_s[first::2], samples[first::2])(grid[inside])
        error = max(error, float(np.max(np.abs(coarse - values[inside]), initial=0.0)))
    return values, error
