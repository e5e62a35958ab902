"""Lines of a spectrum: so many to an octave (ISO 18431-4: 6 for 5 % damping)."""

from __future__ import annotations

import math

import numpy as np

from ...array_types import Floats

PER_OCTAVE = 6
#: Ten samples a cycle: what a record shows of a line above is off by more than 8 %.
SAMPLES_PER_CYCLE = 10.0


def octave_grid(low_hz: float, high_hz: float, per_octave: int = PER_OCTAVE) -> Floats:
    """Lines from `low_hz` in equal ratios, and `high_hz` as the last one, whose step may be shorter.

    Raises `ValueError` for ends that are no range and for less than one line to an octave.
    """
    if not (0 < low_hz <= high_hz < math.inf):
        raise ValueError(f"lines from {low_hz!r} to {high_hz!r} Hz: expected 0 < low <= high")
    if per_octave < 1:
        raise ValueError(f"per_octave = {per_octave!r}: expected 1 or more")
    count = math.floor(per_octave * math.log2(high_hz / low_hz) + 1e-9)
    lines = low_hz * 2 ** (np.arange(count + 1) / per_octave)
    if lines[-1] < high_hz * (1 - 1e-9):
        return np.append(lines, high_hz)
    lines[-1] = high_hz
    return np.asarray(lines)


def grid_of_record(samples: int, sampling_rate_hz: float, per_octave: int = PER_OCTAVE) -> Floats:
    """From one cycle in the record up to `SAMPLES_PER_CYCLE`. Raises `ValueError` for a record too short for a line."""
    low, high = sampling_rate_hz / samples, sampling_rate_hz / SAMPLES_PER_CYCLE
    if low > high:
        raise ValueError(f"{samples} samples: expected {SAMPLES_PER_CYCLE:g} or more, or frequency_hz of your own")
    return octave_grid(low, high, per_octave)
