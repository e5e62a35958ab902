"""Pulses out of a force record with `scipy.signal.find_peaks`, as a user of scipy would write it on an afternoon."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

#: As ours by default: events above a tenth of the largest, contacts down to 0.5 % of the peak, 0.1 s between swings.
EVENT_SHARE, END_SHARE, APART_S = 0.1, 0.005, 0.1
#: What counts as a second hit: from 5 % of the first, a millisecond after it at least.
SECOND_SHARE, SECOND_APART_S = 0.05, 1e-3
POINTS = 20


@dataclass(frozen=True)
class Found:
    """One pulse; its points (20,) are equidistant over the contact."""

    start_s: float
    contact_time_s: float
    peak_force_n: float
    impulse_n_s: float
    points_n: Floats
    peak: int


def by_peak_widths(force: Floats, rate_hz: float) -> list[Found]:
    """`find_peaks`, then `peak_widths` at 99.5 % of the prominence: ten lines from the manual."""
    from scipy.signal import find_peaks, peak_widths

    peaks, _ = find_peaks(force, height=EVENT_SHARE * force.max(), distance=round(APART_S * rate_hz))
    _, _, left, right = peak_widths(force, peaks, rel_height=1 - END_SHARE)
    return [_found(force, *each, rate_hz) for each in zip(peaks.tolist(), left.tolist(), right.tolist(), strict=True)]


def by_threshold(force: Floats, rate_hz: float) -> list[Found]:
    """`find_peaks` on the record less its median, then outward from each peak to the first sample below the share."""
    from scipy.signal import find_peaks

    force = force - np.median(force)
    peaks, _ = find_peaks(force, height=EVENT_SHARE * force.max(), distance=round(APART_S * rate_hz))
    found = []
    for peak in peaks.tolist():
        reach = round(APART_S * rate_hz)
        low, high = max(0, peak - reach), min(force.size, peak + reach)
        below = low + np.flatnonzero(force[low:high] <= END_SHARE * force[peak])
        before, after = below[below < peak], below[below > peak]
        found.append(
            _found(force, peak, before[-1] if before.size else low, after[0] if after.size else high - 1, rate_hz)
        )
    return found


def second_hits(force: Floats, found: list[Found], rate_hz: float) -> list[bool]:
    """Of each pulse whether `find_peaks` sees another peak within 0.1 s after its contact."""
    from scipy.signal import find_peaks

    seen = []
    for one in found:
        end = round((one.start_s + one.contact_time_s) * rate_hz)
        after = force[end : end + round(APART_S * rate_hz)]
        height = SECOND_SHARE * one.peak_force_n
        peaks, _ = find_peaks(after, height=height, prominence=height, distance=max(1, round(SECOND_APART_S * rate_hz)))
        seen.append(bool(peaks.size))
    return seen


def _found(force: Floats, peak: int, left: float, right: float, rate_hz: float) -> Found:
    inside = np.arange(int(np.floor(left)), int(np.ceil(right)) + 1)
    values = force[inside]
    points = np.interp(np.linspace(left, right, POINTS), inside, values)
    impulse = float(np.trapezoid(values, dx=1 / rate_hz))
    return Found(left / rate_hz, (right - left) / rate_hz, float(force[peak]), impulse, points, peak)
