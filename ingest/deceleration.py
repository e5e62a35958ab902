"""The impactor's velocity at first contact, from its deceleration (thesis, section 4.1)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..array_types import Floats
from .segmentation import rest_level

#: A contact has begun above this share of its peak (thesis, section 4.1), or this many noise deviations.
_ONSET_SHARE, _ONSET_NOISE = 0.005, 4.0
#: Samples above this share of the peak locate it: a cubic through them is within 0.02 samples on clean pulses.
_PEAK_SHARE = 0.7
#: The contact is refined ten times (thesis, section 4.1): how finely interpolation can place the end of compression.
_REFINEMENT = 10


@dataclass(frozen=True)
class ImpactVelocity:
    """An impactor's velocity at first contact, positive; onset and end of compression in fractional samples."""

    velocity_m_s: float
    velocity_u_m_s: float
    onset_sample: float
    end_of_compression_sample: float


def impact_velocity(
    acceleration_m_s2: Floats,
    sampling_rate_hz: float,
    first: int,
    peak: int,
    *,
    noise_m_s2: float | None = None,
    gain_u: float = 0.0,
) -> ImpactVelocity:
    """Integral of the impactor's deceleration (n,) from first contact to the end of compression, where it stands still.

    `first` and `peak` are samples of the contact as segmentation found it. A cubic spline through the contact's samples
    is integrated from where it is zero before the first of them to the acceleration's peak, both between samples: on
    ten samples per contact the trapezoid rule between whole samples is wrong by up to 16 % of the velocity.

    Standard uncertainty by the GUM: the noise, integrated; the end of compression, by the noise and by a tenth
    of a sample (uniform); `gain_u`, the relative standard uncertainty of the sensor's gain. `noise_m_s2` is by
    default the deviation of up to 200 samples before the contact. Raises `ValueError` when there are fewer than 16.
    """
    values = np.asarray(acceleration_m_s2, dtype=np.float64)
    if not 0 <= first < peak < values.size - 1:
        raise ValueError(f"contact from {first} to peak {peak}: expected 0 <= first < peak < {values.size - 1}")
    noise = _noise_before(values, first) if noise_m_s2 is None else noise_m_s2
    values = values * np.sign(values[peak])
    top, jitter, last = _end_of_compression(values, peak, noise)
    onset, area = _integral(values, first, peak, top, last, noise)
    period = 1 / sampling_rate_hz
    timing = np.hypot(jitter, 1 / _REFINEMENT / np.sqrt(12))
    spread = period * np.hypot(noise * np.sqrt(top - onset), values[peak] * timing)
    velocity = area * period
    return ImpactVelocity(velocity, float(np.hypot(spread, gain_u * velocity)), onset, top)


def _noise_before(values: Floats, first: int) -> float:
    quiet = values[max(0, first - 204) : max(0, first - 4)]
    if quiet.size < 16:
        raise ValueError(
            f"{quiet.size} samples before the contact at {first}: give `noise_m_s2`, or at least 16 samples"
        )
    return rest_level(quiet).noise


def _end_of_compression(values: Floats, peak: int, noise: float) -> tuple[float, float, int]:
    """The peak between samples, its standard uncertainty by noise (samples), and the last sample that was used."""
    low = np.flatnonzero(values[:peak] < _PEAK_SHARE * values[peak])
    high = np.flatnonzero(values[peak:] < _PEAK_SHARE * values[peak])
    begin = min(peak - 1, int(low[-1]) + 1 if low.size else 0)
    end = max(peak + 1, peak + int(high[0]) - 1 if high.size else values.size - 1)
    x = np.arange(begin, end + 1.0) - peak
    basis = np.vander(x, 4 if x.size >= 5 else 3, increasing=True)
    cubic = np.polynomial.Polynomial(np.linalg.lstsq(basis, values[begin : end + 1])[0])
    top = _maximum(cubic, float(x[0]), float(x[-1]))
    powers = np.arange(basis.shape[1])
    slope = powers * top ** np.maximum(powers - 1, 0)  # of the basis: the slope's noise over the curvature
    variance = slope @ np.linalg.inv(basis.T @ basis) @ slope
    curvature = max(abs(cubic.deriv(2)(top)), np.finfo(np.float64).tiny)
    return peak + top, min(noise * float(np.sqrt(variance)) / curvature, float(x.size)), end


def _maximum(cubic: np.polynomial.Polynomial, low: float, high: float) -> float:
    """Where a cubic or parabola has its maximum within [low, high].

    0.0 where it has none there, or does not curve down at 0.0.
    Not by a general root finder: a symmetric contact has a cubic term of rounding errors, which throws its roots off.
    """
    slope, curvature, third = (*cubic.deriv().coef, 0.0)[:3]
    discriminant = curvature**2 - 4 * third * slope
    if curvature >= 0 or discriminant <= 0:
        return 0.0
    top = 2 * slope / (np.sqrt(discriminant) - curvature)
    return float(top) if low <= top <= high else 0.0


def _integral(values: Floats, first: int, peak: int, top: float, last: int, noise: float) -> tuple[float, float]:
    """Onset (samples) and the spline's integral from it to `top`, per sample."""
    from scipy.interpolate import CubicSpline

    # Samples before the onset belong to another curve: a spline through them would ring into the contact.
    above = values[first : peak + 1] > max(_ONSET_SHARE * values[peak], _ONSET_NOISE * noise)
    start = first + int(np.argmax(above))
    x = np.arange(start, min(values.size, last + 4))
    spline = CubicSpline(x, values[x])
    zeros = spline.roots(extrapolate=True)
    zeros = zeros[(zeros >= start - 1) & (zeros <= start)]
    onset = float(zeros.max()) if zeros.size else start - 1.0
    return onset, float(spline.integrate(onset, top))
