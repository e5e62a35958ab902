"""Delay of a hammer's accelerometer behind its load cell: the wave's travel, and no more (thesis, section 4.1)."""

from __future__ import annotations

import math

import numpy as np

from ..array_types import Floats


def propagation_delay(youngs_modulus_pa: float, density_kg_m3: float, length_m: float) -> float:
    """Time (s) of a compression wave along `length_m`: eq. 4.1, for a slender bar."""
    return length_m / math.sqrt(youngs_modulus_pa / density_kg_m3)


def measured_delay_samples(force: Floats, acceleration: Floats, first: int, last: int, *, longest: int = 16) -> float:
    """Samples by which `acceleration` (n,) follows `force` (n,) in the contact `first` to `last`; negative: it leads.

    The peak of the cross-correlation, between samples by a cubic spline; either polarity. The answer is within
    ±`longest`, and at that limit where the two are not alike. Raises `ValueError` for a contact outside the record.
    """
    if not 0 <= first < last < force.size or force.shape != acceleration.shape:
        raise ValueError(f"contact {first} to {last} in records of {force.shape} and {acceleration.shape} samples")
    from scipy.interpolate import CubicSpline

    around = np.pad(acceleration, longest)[first : last + 2 * longest + 1]
    likeness = np.correlate(around, force[first : last + 1], mode="valid")
    lags = np.arange(-longest, longest + 1)
    best = int(np.argmax(np.abs(likeness)))
    spline = CubicSpline(lags, likeness * np.sign(likeness[best]))
    turns = spline.derivative().roots(extrapolate=False)
    turns = turns[np.abs(turns - lags[best]) <= 1]
    return float(turns[np.argmax(spline(turns))]) if turns.size else float(lags[best])


def delay_is_plausible(
    delay_samples: float, wave_time_s: float, sampling_rate_hz: float, *, tolerance_samples: float = 2.0
) -> bool:
    """Whether a delay is the wave's travel to within two samples (the thesis' discrepancy), either way."""
    return abs(delay_samples - wave_time_s * sampling_rate_hz) <= tolerance_samples
