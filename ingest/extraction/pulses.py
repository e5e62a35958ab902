"""From a force record to pulses: segment, smooth, resample, measure (thesis, sections 4.1 and
4.2.2).

The cubic smoothing spline (eq. 4.6 and MATLAB's `csaps`) is on the sample index. With x in seconds
the problem is so badly scaled that libraries return no smoothing, or refuse (scipy and csaps both);
on the index it is well posed and p means the same at every sampling rate. `csaps` with parameter p
is scipy's `make_smoothing_spline` with lam = (1 - p) / p, which this equals to rounding. On the
index its equations are the same few numbers in every row, and need not be built from divided
differences: a tenth of the time.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from ...signals.checks.base import Contact
from .segmentation import RestLevel, Segment, delimit, find_events, orientation, record_rest
from .settings import ExtractionSettings

#: scipy's smoothing spline needs five points; below, the interpolating cubic (or less) is all there
#: is.
_SMALLEST_SMOOTHED = 5


def smoothing_spline(values: Floats, smoothing: float) -> Callable[[Floats], Floats]:
    """The cubic smoothing spline through values at x = 0 … n-1.

    With R and Q of a natural spline, (R + lam Q'Q) c = Q'y gives its second derivatives, y - lam Q
    c its values.

    Parameters:
        values: The values (n,), n >= 2.
        smoothing: The parameter p of csaps, in (0, 1]; 1 interpolates.

    Returns:
        A function of x, in samples.

    Source:
        Green and Silverman, Nonparametric Regression and Generalized Linear Models (1994), section
        2.3.
    """
    from scipy.interpolate import PPoly, make_interp_spline
    from scipy.linalg import solveh_banded

    if smoothing >= 1.0 or values.size < _SMALLEST_SMOOTHED:
        x = np.arange(values.size, dtype=np.float64)
        return make_interp_spline(x, values, k=min(3, values.size - 1))
    lam = (1.0 - smoothing) / smoothing
    bands = np.empty(
        (3, values.size - 2)
    )  # upper form; what lies outside of the matrix is not looked at
    bands[0], bands[1], bands[2] = lam, 1 / 6 - 4 * lam, 2 / 3 + 6 * lam
    padded = np.zeros(values.size + 2)
    padded[2:-2] = solveh_banded(bands, np.diff(values, 2), overwrite_ab=True, check_finite=False)
    bending, fitted = padded[1:-1], values - lam * np.diff(padded, 2)
    slope = np.diff(fitted) - (2 * bending[:-1] + bending[1:]) / 6
    pieces = np.array([np.diff(bending) / 6, bending[:-1] / 2, slope, fitted[:-1]])
    return PPoly.construct_fast(pieces, np.arange(values.size, dtype=np.float64))


def nrmse(values: Floats, fitted: Floats) -> float:
    """Root mean square error over the range of the values; 0 for a flat signal.

    Parameters:
        values: The recorded values (n,).
        fitted: The values (n,) of a fit to them, in the same unit.

    Source:
        Thesis, eq. 4.3 and 4.4.
    """
    spread = float(values.max() - values.min())
    return float(np.sqrt(np.mean((values - fitted) ** 2))) / spread if spread > 0 else 0.0


#: Samples on either side of the contact that the spline sees, so that its ends are not its weak
#: spots.
_MARGIN = 4
#: As in `signals.checks.double_hit`: a swing below rest by more than this share of a peak is
#: ringing.
_RINGING_SHARE = 0.5


@dataclass(frozen=True)
class Touch:
    """A contact that is not cut out: the time of its peak (s, on the record's clock) and its peak
    (N) above rest."""

    time_s: float
    peak_force_n: float


@dataclass(frozen=True)
class ExtractedPulse:
    """One contact's force. Times in seconds on the record's clock, forces in newtons above the rest
    before the hit.

    `peak_force_n` and the widths are those of the recorded samples (widths cross linearly between
    them), as published records state them; `spline_peak_force_n`, the impulses and the time of
    compression are the spline's, which comes nearer to the truth between samples on short contacts.
    `force_points_n` (points,) are equidistant over the contact, both ends included; `fine_force_n`
    (m,) has `refinement` points per recorded sample. `rest_n` is that rest in the record, turned by
    `sign`; `threshold_n` the force above it at which the contact was delimited.
    """

    contact: Contact
    start_s: float
    contact_time_s: float
    compression_time_s: float
    peak_force_n: float
    spline_peak_force_n: float
    impulse_n_s: float
    compression_impulse_n_s: float
    width_half_s: float
    width_tenth_s: float
    samples_in_contact: int
    spline_nrmse: float
    segmentation_difference: float
    force_points_n: Floats
    fine_force_n: Floats
    fine_period_s: float
    threshold_raised: bool
    truncated: bool
    extra_hits: int
    sign: int
    rest_n: float
    threshold_n: float
    #: Contacts within the separation before this one, lower than it: they belong to the same
    #: impact.
    earlier_touches: tuple[Touch, ...] = ()


@dataclass(frozen=True)
class Hits:
    """The pulses of a record in time order, and the hits that were left out because fewer were
    expected."""

    pulses: tuple[ExtractedPulse, ...]
    left_out: tuple[Touch, ...] = ()


def extract_pulses(
    force: Floats,
    sampling_rate_hz: float,
    settings: ExtractionSettings | None = None,
    *,
    start_s: float = 0.0,
    expected: int | None = None,
) -> tuple[ExtractedPulse, ...]:
    """The pulses of a force record, in time order; none when nothing rises above the noise.

    Parameters:
        force: The record (n,) in N. Compression may have either sign.
        sampling_rate_hz: Its sampling rate.
        settings: How pulses are cut out; by default the defaults of `ExtractionSettings`.
        start_s: The time of the first sample on the record's clock; by default 0.
        expected: The number of main peaks that are kept where the record shows more (the thesis's
            "ten main peaks"); by default (None) all.
    """
    return find_hits(force, sampling_rate_hz, settings, start_s=start_s, expected=expected).pulses


def find_hits(
    force: Floats,
    sampling_rate_hz: float,
    settings: ExtractionSettings | None = None,
    *,
    start_s: float = 0.0,
    expected: int | None = None,
) -> Hits:
    """`extract_pulses`, with the hits beyond the expected ones as well: nothing that was found is
    forgotten.

    Parameters:
        force: The record (n,) in N. Compression may have either sign.
        sampling_rate_hz: Its sampling rate.
        settings: How pulses are cut out; by default the defaults of `ExtractionSettings`.
        start_s: The time of the first sample on the record's clock; by default 0.
        expected: The number of main peaks that become pulses where the record shows more; by
            default (None) all.
    """
    settings = settings or ExtractionSettings()
    if force.size < 2 or not np.isfinite(force).any():
        return Hits(())
    level = record_rest(force)
    sign = orientation(force, level)
    upright = force if sign > 0 else -force
    level = level if sign > 0 else RestLevel(-level.baseline, level.noise)
    events = find_events(upright, level, sampling_rate_hz, settings)
    left_out: list[int] = []
    if expected is not None and len(events) > expected:
        by_height = sorted(events, key=lambda peaks: -upright[peaks[0]])
        events = sorted(by_height[:expected], key=lambda peaks: int(peaks[0]))
        left_out = sorted(int(peaks[0]) for peaks in by_height[expected:])
    pulses = []
    for peaks in events:
        rest, extents = delimit(upright, peaks, level, sampling_rate_hz, settings)
        pulse = _measure(upright, rest, extents, sampling_rate_hz, settings, start_s, sign)
        earlier = _touches_before(upright, peaks, extents.contact.first, rest)
        if earlier:
            pulse = replace(
                pulse, earlier_touches=_touches(upright, earlier, rest, sampling_rate_hz, start_s)
            )
        pulses.append(pulse)
    return Hits(tuple(pulses), _touches(upright, left_out, level, sampling_rate_hz, start_s))


def _touches_before(
    force: Floats, peaks: NDArray[np.int64], first: int, rest: RestLevel
) -> list[int]:
    """Peaks before sample `first` that are contacts: a contact cannot pull, so what swings below
    rest by a good part of its height is the ringing of a filter that has no phase."""
    earlier = []
    for peak in sorted(int(p) for p in peaks if p < first):
        around = force[max(0, 2 * peak - first) : first + 1]
        if rest.baseline - float(np.nanmin(around)) <= _RINGING_SHARE * (
            float(force[peak]) - rest.baseline
        ):
            earlier.append(peak)
    return earlier


def _touches(
    force: Floats, peaks: Iterable[int], rest: RestLevel, sampling_rate_hz: float, start_s: float
) -> tuple[Touch, ...]:
    return tuple(
        Touch(start_s + i / sampling_rate_hz, float(force[i]) - rest.baseline)
        for i in map(int, peaks)
    )


def _measure(
    force: Floats,
    rest: RestLevel,
    segment_found: Segment,
    sampling_rate_hz: float,
    settings: ExtractionSettings,
    start_s: float,
    sign: int,
) -> ExtractedPulse:
    first, last = segment_found.contact.first, segment_found.contact.last
    low, high = max(0, first - _MARGIN), min(force.size - 1, last + _MARGIN)
    window = force[low : high + 1] - rest.baseline
    # A sensor's gap inside the margin must not poison the spline: the contact itself holds no NaN
    # by construction.
    window = np.where(np.isfinite(window), window, 0.0)
    spline = smoothing_spline(window, settings.smoothing)
    span = last - first
    at = first - low + np.linspace(0.0, span, span * settings.refinement + 1)
    fine = spline(at)
    period = 1.0 / (sampling_rate_hz * settings.refinement)
    top = int(np.argmax(fine))
    recorded = window[first - low : last - low + 1]
    return ExtractedPulse(
        contact=segment_found.contact,
        start_s=start_s + first / sampling_rate_hz,
        contact_time_s=span / sampling_rate_hz,
        compression_time_s=top * period,
        peak_force_n=float(recorded.max()),
        spline_peak_force_n=float(fine[top]),
        impulse_n_s=_integral(fine, period),
        compression_impulse_n_s=_integral(fine[: top + 1], period),
        width_half_s=_width(recorded, 0.5) / sampling_rate_hz,
        width_tenth_s=_width(recorded, 0.1) / sampling_rate_hz,
        samples_in_contact=int(
            np.count_nonzero(recorded > segment_found.threshold - rest.baseline)
        ),
        spline_nrmse=nrmse(recorded, spline(first - low + np.arange(span + 1.0))),
        segmentation_difference=segment_found.difference,
        force_points_n=spline(first - low + np.linspace(0.0, span, settings.points)),
        fine_force_n=fine,
        fine_period_s=period,
        threshold_raised=segment_found.raised,
        truncated=segment_found.truncated,
        extra_hits=segment_found.extra_hits,
        sign=sign,
        rest_n=rest.baseline,
        threshold_n=segment_found.threshold - rest.baseline,
    )


def _integral(values: Floats, period: float) -> float:
    return float(np.trapezoid(values, dx=period)) if values.size > 1 else 0.0


def _width(values: Floats, share: float) -> float:
    """Samples between the crossings of `share` of the peak on either side of it, interpolated
    linearly."""
    top = int(np.argmax(values))
    level = share * values[top]
    below = np.flatnonzero(values[:top] <= level)
    right = np.flatnonzero(values[top:] <= level)
    first = _crossing(values, int(below[-1]), level) if below.size else 0.0
    last = (
        _crossing(values, top + int(right[0]) - 1, level) if right.size else float(values.size - 1)
    )
    return last - first


def _crossing(values: Floats, i: int, level: float) -> float:
    rise = values[i + 1] - values[i]
    return float(i + (level - values[i]) / rise) if rise else float(i)
