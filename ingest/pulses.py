"""From a force record to pulses: segment, smooth, resample, measure (thesis, sections 4.1 and 4.2.2)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .contact import Contact
from .segmentation import Level, Segment, delimit, find_events, orientation, record_rest
from .settings import ExtractionSettings
from .spline import nrmse, smoothing_spline

Floats = NDArray[np.float64]

#: Samples on either side of the contact that the spline sees, so that its ends are not its weak spots.
_MARGIN = 4


@dataclass(frozen=True)
class Pulse:
    """One contact's force. Times in seconds on the record's clock, forces in newtons above the rest before the hit.

    `peak_force_n` and the widths are those of the recorded samples (widths cross linearly between them), as
    published records state them; `spline_peak_force_n`, the impulses and the time of compression are the
    spline's, which comes nearer to the truth between samples on short contacts.
    `force_points_n` (points,) are equidistant over the contact, both ends included; `fine_force_n` (m,) has
    `refinement` points per recorded sample. `rest_n` is that rest in the record, turned by `sign`; `threshold_n` the
    force above it at which the contact was delimited.
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


def extract_pulses(
    force: Floats,
    sampling_rate_hz: float,
    settings: ExtractionSettings | None = None,
    *,
    start_s: float = 0.0,
    expected: int | None = None,
) -> tuple[Pulse, ...]:
    """The pulses of a force record (n,) in newtons, in time order; none when nothing rises above the noise.

    `expected` keeps that many main peaks where the record shows more (the thesis's "ten main peaks").
    """
    settings = settings or ExtractionSettings()
    if force.size < 2 or not np.isfinite(force).any():
        return ()
    level = record_rest(force)
    sign = orientation(force, level)
    upright = force if sign > 0 else -force
    level = level if sign > 0 else Level(-level.baseline, level.noise)
    events = find_events(upright, level, sampling_rate_hz, settings)
    if expected is not None and len(events) > expected:
        largest = sorted(events, key=lambda peaks: -upright[peaks[0]])[:expected]
        events = sorted(largest, key=lambda peaks: int(peaks[0]))
    pulses = []
    for peaks in events:
        rest, found = delimit(upright, peaks, level, sampling_rate_hz, settings)
        pulses.append(_measure(upright, rest, found, sampling_rate_hz, settings, start_s, sign))
    return tuple(pulses)


def _measure(
    force: Floats,
    rest: Level,
    found: Segment,
    sampling_rate_hz: float,
    settings: ExtractionSettings,
    start_s: float,
    sign: int,
) -> Pulse:
    first, last = found.contact.first, found.contact.last
    low, high = max(0, first - _MARGIN), min(force.size - 1, last + _MARGIN)
    window = force[low : high + 1] - rest.baseline
    # A sensor's gap inside the margin must not poison the spline: the contact itself holds no NaN by construction.
    window = np.where(np.isfinite(window), window, 0.0)
    spline = smoothing_spline(window, settings.smoothing)
    span = last - first
    at = first - low + np.linspace(0.0, span, span * settings.refinement + 1)
    fine = spline(at)
    period = 1.0 / (sampling_rate_hz * settings.refinement)
    top = int(np.argmax(fine))
    recorded = window[first - low : last - low + 1]
    return Pulse(
        contact=found.contact,
        start_s=start_s + first / sampling_rate_hz,
        contact_time_s=span / sampling_rate_hz,
        compression_time_s=top * period,
        peak_force_n=float(recorded.max()),
        spline_peak_force_n=float(fine[top]),
        impulse_n_s=_integral(fine, period),
        compression_impulse_n_s=_integral(fine[: top + 1], period),
        width_half_s=_width(recorded, 0.5) / sampling_rate_hz,
        width_tenth_s=_width(recorded, 0.1) / sampling_rate_hz,
        samples_in_contact=int(np.count_nonzero(recorded > found.threshold - rest.baseline)),
        spline_nrmse=nrmse(recorded, spline(first - low + np.arange(span + 1.0))),
        segmentation_difference=found.difference,
        force_points_n=spline(first - low + np.linspace(0.0, span, settings.points)),
        fine_force_n=fine,
        fine_period_s=period,
        threshold_raised=found.raised,
        truncated=found.truncated,
        extra_hits=found.extra_hits,
        sign=sign,
        rest_n=rest.baseline,
        threshold_n=found.threshold - rest.baseline,
    )


def _integral(values: Floats, period: float) -> float:
    return float(np.trapezoid(values, dx=period)) if values.size > 1 else 0.0


def _width(values: Floats, share: float) -> float:
    """Samples between the crossings of `share` of the peak on either side of it, interpolated linearly."""
    top = int(np.argmax(values))
    level = share * values[top]
    left = np.flatnonzero(values[:top] <= level)
    right = np.flatnonzero(values[top:] <= level)
    first = _crossing(values, int(left[-1]), level) if left.size else 0.0
    last = _crossing(values, top + int(right[0]) - 1, level) if right.size else float(values.size - 1)
    return last - first


def _crossing(values: Floats, i: int, level: float) -> float:
    rise = values[i + 1] - values[i]
    return float(i + (level - values[i]) / rise) if rise else float(i)
