"""Velocities of the bench: at the muzzle by the laser that the bullet interrupts (thesis, sections
2.2.1 and 5.1), at contact by the impactor's deceleration (section 4.1)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...array_types import Floats
from .segmentation import rest_level

#: A contact has begun above this share of its peak (thesis, section 4.1), or this many noise
#: deviations.
_ONSET_SHARE, _ONSET_NOISE = 0.005, 4.0
#: Samples above this share of the peak locate it: a cubic through them is within 0.02 samples on
#: clean pulses.
_PEAK_SHARE = 0.7
#: The contact is refined ten times (thesis, section 4.1): how finely interpolation can place the
#: end of compression.
_REFINEMENT = 10


@dataclass(frozen=True)
class ImpactVelocity:
    """An impactor's velocity at first contact, positive; onset and end of compression in fractional
    samples."""

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
    """Integral of the impactor's deceleration from first contact to the end of compression, where
    it stands still.

    A cubic spline through the contact's samples is integrated from where it is zero before the
    first of them to the acceleration's peak, both between samples: on ten samples per contact the
    trapezoid rule between whole samples is wrong by up to 16 % of the velocity.

    Standard uncertainty by the GUM: the noise, integrated; the end of compression, by the noise and
    by a tenth of a sample (uniform); and the sensor's gain.

    Parameters:
        acceleration_m_s2: The record (n,) of the impactor's acceleration, of either sign.
        sampling_rate_hz: Its sampling rate.
        first: The first sample of the contact as segmentation found it.
        peak: The sample of its peak.
        noise_m_s2: The standard deviation of the noise. It is by default the deviation of up to 200
            samples before the contact.
        gain_u: The relative standard uncertainty of the sensor's gain; by default 0, none.

    Raises:
        ValueError: When `noise_m_s2` is not given and there are fewer than 16 samples before the
            contact, and for a contact outside of the record.
    """
    values = np.asarray(acceleration_m_s2, dtype=np.float64)
    if not 0 <= first < peak < values.size - 1:
        raise ValueError(
            f"contact from {first} to peak {peak}: expected 0 <= first < peak < {values.size - 1}"
        )
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
            f"{quiet.size} samples before the contact at {first}: give "
            f"`noise_m_s2`, or at least 16 samples"
        )
    return rest_level(quiet).noise


def _end_of_compression(values: Floats, peak: int, noise: float) -> tuple[float, float, int]:
    """The peak between samples, its standard uncertainty by noise (samples), and the last sample
    that was used."""
    low = np.flatnonzero(values[:peak] < _PEAK_SHARE * values[peak])
    high = np.flatnonzero(values[peak:] < _PEAK_SHARE * values[peak])
    begin = min(peak - 1, int(low[-1]) + 1 if low.size else 0)
    end = max(peak + 1, peak + int(high[0]) - 1 if high.size else values.size - 1)
    x = np.arange(begin, end + 1.0) - peak
    basis = np.vander(x, 4 if x.size >= 5 else 3, increasing=True)
    cubic = np.polynomial.Polynomial(np.linalg.lstsq(basis, values[begin : end + 1])[0])
    top = _maximum(cubic, float(x[0]), float(x[-1]))
    powers = np.arange(basis.shape[1])
    slope = powers * top ** np.maximum(
        powers - 1, 0
    )  # of the basis: the slope's noise over the curvature
    variance = slope @ np.linalg.inv(basis.T @ basis) @ slope
    curvature = max(abs(cubic.deriv(2)(top)), np.finfo(np.float64).tiny)
    return peak + top, min(noise * float(np.sqrt(variance)) / curvature, float(x.size)), end


def _maximum(cubic: np.polynomial.Polynomial, low: float, high: float) -> float:
    """Where a cubic or parabola has its maximum within [low, high].

    0.0 where it has none there, or does not curve down at 0.0. Not by a general root finder: a
    symmetric contact has a cubic term of rounding errors, which throws its roots off.
    """
    slope, curvature, third = (*cubic.deriv().coef, 0.0)[:3]
    discriminant = curvature**2 - 4 * third * slope
    if curvature >= 0 or discriminant <= 0:
        return 0.0
    top = 2 * slope / (np.sqrt(discriminant) - curvature)
    return float(top) if low <= top <= high else 0.0


def _integral(
    values: Floats, first: int, peak: int, top: float, last: int, noise: float
) -> tuple[float, float]:
    """Onset (samples) and the spline's integral from it to `top`, per sample."""
    from scipy.interpolate import CubicSpline

    # Samples before the onset belong to another curve: a spline through them would ring into the
    # contact.
    above = values[first : peak + 1] > max(_ONSET_SHARE * values[peak], _ONSET_NOISE * noise)
    start = first + int(np.argmax(above))
    x = np.arange(start, min(values.size, last + 4))
    spline = CubicSpline(x, values[x])
    zeros = spline.roots(extrapolate=True)
    zeros = zeros[(zeros >= start - 1) & (zeros <= start)]
    onset = float(zeros.max()) if zeros.size else start - 1.0
    return onset, float(spline.integrate(onset, top))


#: A passage is deeper than this many standard deviations of the noise at rest, and than this share
#: of the deepest one.
_LASER_NOISE_MARGIN, _DEPTH_SHARE = 8.0, 1 / 3
#: Shorter interruptions are spikes: 85 mm at 80 m/s is 26 samples at 25 kHz.
_SHORTEST_PASSAGE = 5


class NoPassageError(ValueError):
    """The laser saw no whole passage; the message says what it saw instead."""


@dataclass(frozen=True)
class MuzzleVelocity:
    """A bullet's passage; the edges in (fractional) samples, the levels in the signal's own
    unit."""

    velocity_m_s: float
    velocity_u_m_s: float
    transit_time_s: float
    enter_sample: float
    leave_sample: float
    rest_level: float
    blocked_level: float


def muzzle_velocity(
    signal: NDArray[Any], sampling_rate_hz: float, length_m: float, *, length_u_m: float = 1e-3
) -> MuzzleVelocity:
    """Bullet length over the time that it stays in the beam, first passage only (a rebound may
    bring it back).

    The edges are where the signal crosses half the depth of the passage, between samples; the
    time's uncertainty also holds what noise and hum move a slow edge by.

    Parameters:
        signal: The laser's record (n,) in volts or metres, of either polarity. Its first fiftieth
            (32 samples at least) shows the beam free.
        sampling_rate_hz: Its sampling rate.
        length_m: The length of the bullet.
        length_u_m: The standard uncertainty of this length; by default 1 mm.

    Raises:
        NoPassageError: Where nothing crosses, or the bullet is in the beam at the record's end.
        ValueError: For a sample that is not finite.

    Source:
        Thesis, eq. 5.2, for the uncertainty.
    """
    values = np.asarray(signal, dtype=np.float64)
    if not np.all(np.isfinite(values)):
        raise ValueError(
            f"laser signal: sample {int(np.argmin(np.isfinite(values)))} is not finite"
        )
    rest = rest_level(values[: max(32, values.size // 50)])
    enter, leave, depth, edges_u = _first_passage(values - rest.baseline, rest.noise)
    transit = (leave - enter) / sampling_rate_hz
    time_u = float(np.hypot(1.0, edges_u)) / sampling_rate_hz
    spread = muzzle_velocity_uncertainty(length_m, transit, length_u_m, time_u_s=time_u)
    blocked = rest.baseline + depth
    return MuzzleVelocity(
        length_m / transit, float(spread), transit, enter, leave, rest.baseline, blocked
    )


def muzzle_velocity_uncertainty(
    length_m: ArrayLike,
    transit_time_s: ArrayLike,
    length_u_m: ArrayLike = 1e-3,
    *,
    time_u_s: ArrayLike,
) -> Floats:
    """Standard uncertainty (m/s) of length over time; the arguments are broadcast.

    Parameters:
        length_m: The length of the bullet (...,).
        transit_time_s: The time (...,) that the bullet stays in the beam.
        length_u_m: The standard uncertainty of the length; by default 1 mm.
        time_u_s: The standard uncertainty of the time. That of the thesis is one sampling period.

    Source:
        Thesis, eq. 5.2.
    """
    length, time = (
        np.asarray(length_m, dtype=np.float64),
        np.asarray(transit_time_s, dtype=np.float64),
    )
    spread = np.hypot(np.asarray(length_u_m) / time, length * np.asarray(time_u_s) / time**2)
    return np.asarray(spread, dtype=np.float64)


def _first_passage(departure: Floats, noise: float) -> tuple[float, float, float, float]:
    """Edges (samples), depth (signed) and the edges' uncertainty (samples) of the first long
    excursion of `departure` (n,) from rest."""
    from scipy.ndimage import median_filter

    smooth = median_filter(departure, size=_SHORTEST_PASSAGE) if departure.size else departure
    extreme = float(smooth[np.argmax(np.abs(smooth))]) if departure.size else 0.0
    if not abs(extreme) > _LASER_NOISE_MARGIN * noise:
        raise NoPassageError(
            f"no passage: the laser departs from rest by {abs(extreme):.3g} "
            f"at most, and its noise is {noise:.3g}; "
            f"a bullet is expected to exceed {_LASER_NOISE_MARGIN:g} times the noise"
        )
    sign = np.sign(extreme)
    start, stop = _first_long_run(sign * smooth > _DEPTH_SHARE * abs(extreme))
    depth = float(np.median(sign * departure[start:stop]))
    share, smooth = sign * departure / depth, sign * smooth / depth
    enter, rise = _crossing(share, smooth, start)
    from_end, fall = _crossing(share[::-1], smooth[::-1], share.size - stop)
    # Hum has no time to show within the first samples: the deviation of all that lies before the
    # passage has it.
    before = share[: max(32, start - 2 * int(rise) - 1)]
    unrest = float(np.std(before)) if before.size else 0.0
    return (
        enter,
        share.size - 1 - from_end,
        float(sign * depth),
        unrest * float(np.hypot(rise, fall)),
    )


def _first_long_run(blocked: NDArray[np.bool_]) -> tuple[int, int]:
    steps = np.diff(blocked.astype(np.int8), prepend=0)
    starts, stops = np.flatnonzero(steps == 1), np.flatnonzero(steps == -1)
    for start, stop in zip(starts, stops, strict=False):  # the last run may not stop
        if stop - start >= _SHORTEST_PASSAGE:
            return int(start), int(stop)
    seen = (
        f"the beam is blocked at sample {starts[-1]} and not freed by the "
        f"record's end, sample {blocked.size - 1}"
    )
    raise NoPassageError(
        f"no whole passage: {seen}" if starts.size > stops.size else "no passage: only short spikes"
    )


def _crossing(share: Floats, smooth: Floats, inside: int) -> tuple[float, float]:
    """Where `share` (1 = blocked) last crosses one half before the blocked sample `inside`, in
    fractional samples, and how many samples its whole rise takes by that between the quarter
    points.

    The mean of all crossings between the smoothed signal's quarter points: noise on a slow edge
    makes several.
    """
    free = np.flatnonzero(smooth[:inside] < 0.25)
    if not free.size:
        raise NoPassageError("no whole passage: the beam is never free on one side of it")
    low = int(free[-1])
    high = low + int(np.argmax(smooth[low:] > 0.75))
    first = max(0, low - 1)
    stretch = share[first : high + 2] - 0.5
    at = np.flatnonzero((stretch[:-1] < 0) != (stretch[1:] < 0))
    crossing = float(first + np.mean(at + stretch[at] / (stretch[at] - stretch[at + 1])))
    return crossing, 2.0 * max(high - low - 1, 0)
