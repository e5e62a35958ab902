"""Where the contacts of a force record lie: the two methods of the thesis, section 4.1 (Fig. 4.3).

Both first find the impacts: stretches above a level, grouped when nearer than a separation. The
walk then goes outward from each peak to the first sample at or below the threshold; the mask takes
the record's logical array "above the threshold" and its steps, as MATLAB's `diff` gives them: the
sample before the rise, and the last one before the fall. On the same pulse the mask is therefore
one sample shorter, the 12 % that the thesis saw on nine-sample contacts.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from ...signals.checks.base import Contact

if TYPE_CHECKING:
    from .settings import ExtractionSettings


#: Samples for an estimate of baseline and noise: enough for 1 %, cheap on a record of millions.
_ESTIMATE_SAMPLES = 16384
#: Fewer samples say nothing of a rest.
_LEAST_SAMPLES = 16
#: Where more of a record than this share lies beyond `_FOOT` of its height, its median is not its
#: rest.
_FILLED, _FOOT = 0.2, 0.05
#: What lies so near before a contact, as a share of its length, may be its flank already: below a
#: twentieth of the peak a half sine spends 2 % of its length, and its square 8 %.
_FLANK = 0.15
#: Share of the peak to which a contact is followed before its rest is known.
_ROUGH_SHARE = 0.1
#: A robust standard deviation is this times the median absolute deviation (normal noise).
_MAD_TO_SIGMA = 1.4826


@dataclass(frozen=True)
class RestLevel:
    """A record's rest: `baseline` and the standard deviation `noise` about it, both in the record's
    unit."""

    baseline: float
    noise: float


@dataclass(frozen=True)
class Segment:
    """One contact, and how it was delimited.

    `walk` and `mask` are (first, last) by either method; `threshold` is the force level used and
    `raised` says whether noise lifted it above its share of the peak. `truncated`: the record
    begins or ends inside the contact.
    """

    contact: Contact
    walk: tuple[int, int]
    mask: tuple[int, int]
    threshold: float
    raised: bool
    truncated: bool
    extra_hits: int  # further contacts within the separation

    @property
    def difference(self) -> float:
        """Equation 4.5 as a share: (tau_walk - tau_mask) / tau_walk."""
        walk = self.walk[1] - self.walk[0]
        return (walk - (self.mask[1] - self.mask[0])) / walk if walk else 0.0


def rest_level(force: Floats) -> RestLevel:
    """Median and robust deviation of a record, from an even subsample.

    Parameters:
        force: The record (n,), in any unit. NaN is passed over.
    """
    sample = force[:: max(1, force.size // _ESTIMATE_SAMPLES)]
    sample = sample[np.isfinite(sample)]
    if sample.size == 0:
        return RestLevel(0.0, 0.0)
    baseline = float(np.median(sample))
    return RestLevel(baseline, _MAD_TO_SIGMA * float(np.median(np.abs(sample - baseline))))


def record_rest(force: Floats) -> RestLevel:
    """Rest of a record that contacts may fill: its median and deviation, unless a slow pulse or
    what a sensor sags by after it makes up much of the record. Then those of the stretch before the
    pulse, or else of that behind it.

    Parameters:
        force: The record (n,), in any unit. NaN is passed over.
    """
    whole = rest_level(force)
    sample = force[:: max(1, force.size // _ESTIMATE_SAMPLES)]
    sample = sample[np.isfinite(sample)]
    if sample.size < 2 * _LEAST_SAMPLES:
        return whole
    before, behind = _quiet_stretch(sample), _quiet_stretch(sample[::-1])
    if before is None or behind is None:
        return whole
    return behind if _climbs(sample[:_LEAST_SAMPLES]) else before


def _quiet_stretch(sample: Floats) -> RestLevel | None:
    """Rest of what comes before the excursion of a record (n,); None where that is not much of the
    record."""
    away = np.abs(sample - np.median(sample[:_LEAST_SAMPLES]))
    beyond = np.flatnonzero(away > _FOOT * away.max())
    if beyond.size < _FILLED * sample.size:
        return None
    return rest_level(sample[: max(int(beyond[0] - _FLANK * beyond.size), _LEAST_SAMPLES)])


def _climbs(values: Floats) -> bool:
    """Whether values (n,) lie on a flank, as where a record begins inside of a pulse: a line
    through them climbs or falls by more than four of its standard errors."""
    at = np.arange(values.size) - (values.size - 1) / 2
    slope = float(at @ values) / float(at @ at)
    remainder = values - values.mean() - slope * at
    error = float(np.sqrt(float(remainder @ remainder) / (values.size - 2) / float(at @ at)))
    return abs(slope) > 4 * error


def orientation(force: Floats, level: RestLevel) -> int:
    """The sign in which the record's largest excursion is positive (compression may be negative).

    Parameters:
        force: The record (n,).
        level: The rest of the record.

    Returns:
        +1 or -1.
    """
    up = float(np.nanmax(force)) - level.baseline
    down = level.baseline - float(np.nanmin(force))
    return 1 if up >= down else -1


def find_events(
    force: Floats, level: RestLevel, sampling_rate_hz: float, settings: ExtractionSettings
) -> list[NDArray[np.int64]]:
    """The impacts of a record.

    Parameters:
        force: The record (n,), oriented upwards.
        level: The rest of the record.
        sampling_rate_hz: Its sampling rate.
        settings: From which height on an excursion is an impact, and how near contacts belong to
            one.

    Returns:
        The peaks (sample indices) of the contacts of each impact. The first index of each array is
        the main peak.
    """
    height = float(np.nanmax(force)) - level.baseline if force.size else 0.0
    floor = max(settings.event_share * height, settings.event_noise * level.noise)
    if not np.isfinite(height) or height <= 0 or height < floor:
        return []
    starts, stops = _runs(force > level.baseline + floor)
    gap = max(1, round(settings.separation_s * sampling_rate_hz))
    groups = np.split(np.arange(starts.size), np.flatnonzero(starts[1:] - stops[:-1] >= gap) + 1)
    return [_peaks(force, starts[group], stops[group]) for group in groups if group.size]


def segment(
    force: Floats, peaks: NDArray[np.int64], level: RestLevel, settings: ExtractionSettings
) -> Segment:
    """Delimit the contact around the main peak of an impact.

    Parameters:
        force: The record (n,), oriented upwards.
        peaks: The peaks (k,) of the impact as sample indices, as `find_events` gives them; the
            first is the main peak.
        level: The rest before the contact.
        settings: The threshold and the method.
    """
    peak = int(peaks[0])
    height = float(force[peak]) - level.baseline
    share = settings.threshold * height
    floor = settings.threshold_noise * level.noise
    threshold = level.baseline + max(share, floor)
    first, open_left = _walk_left(force, peak, threshold)
    last, open_right = _walk_right(force, peak, threshold)
    walk = (first, last)
    mask = _mask_run(force, peak, threshold)
    chosen = walk if settings.segmentation == "walk" else mask
    inside = peaks[(peaks >= first) & (peaks <= last)]
    return Segment(
        contact=Contact(chosen[0], peak, chosen[1]),
        walk=walk,
        mask=mask,
        threshold=threshold,
        raised=floor > share,
        truncated=open_left or open_right,
        extra_hits=int(peaks.size - inside.size),
    )


def delimit(
    force: Floats,
    peaks: NDArray[np.int64],
    level: RestLevel,
    sampling_rate_hz: float,
    settings: ExtractionSettings,
) -> tuple[RestLevel, Segment]:
    """The contact around the main peak of an impact, and the rest before it that it was cut by.

    Parameters:
        force: The record (n,), oriented upwards.
        peaks: The peaks (k,) of the impact as sample indices, as `find_events` gives them; the
            first is the main peak.
        level: The rest of the whole record.
        sampling_rate_hz: Its sampling rate.
        settings: The threshold and the method.
    """
    # roughly: a rest that drifts between hits, or that a sensor sags below, is no end of a contact
    roughly = replace(settings, threshold=max(settings.threshold, _ROUGH_SHARE))
    rest = local_baseline(
        force, segment(force, peaks, level, roughly).walk, level, sampling_rate_hz
    )
    contact = segment(force, peaks, rest, settings)
    if contact.walk[1] == force.size - 1 and contact.truncated:
        contact = _until_shifted_rest(force, contact, rest, settings)
    return rest, contact


def _until_shifted_rest(
    force: Floats, contact: Segment, rest: RestLevel, settings: ExtractionSettings
) -> Segment:
    """A contact that seems to last to the record's end, cut where the force comes down to a rest
    above the one before it; unchanged where the second half of what follows the peak is no such
    rest.

    A sensor that rests higher after a hit (zero shift) never comes back to the threshold.
    """
    first, peak = contact.walk[0], contact.contact.peak
    tail = force[peak + (force.size - peak) // 2 :]
    tail = tail[np.isfinite(tail)]
    if tail.size < _LEAST_SAMPLES or _climbs(tail):
        return contact
    shifted = rest_level(tail)
    offset, height = shifted.baseline - rest.baseline, float(force[peak]) - rest.baseline
    if not 0.0 < offset < _ROUGH_SHARE * height:
        return contact
    margin = max(contact.threshold - rest.baseline, settings.threshold_noise * shifted.noise)
    last, open_right = _walk_right(force, peak, shifted.baseline + margin)
    if open_right or force.size - last < last - first:
        return contact
    ends = Contact(
        contact.contact.first, peak, last if settings.segmentation == "walk" else last - 1
    )
    mask = (contact.mask[0], last - 1)
    return replace(contact, contact=ends, walk=(first, last), mask=mask, truncated=first == 0)


def local_baseline(
    force: Floats, walk: tuple[int, int], level: RestLevel, sampling_rate_hz: float
) -> RestLevel:
    """The rest just before a contact: drift between hits must not tilt thresholds.

    Median of the 5 ms (at least 16 samples) that end four samples earlier, of a long contact 15 %
    of it, where the record holds them.

    Parameters:
        force: The record (n,).
        walk: The first and the last sample of the contact.
        level: The rest of the whole record, which is returned where the record holds too few
            samples before the contact. Its noise is taken over.
        sampling_rate_hz: The sampling rate of the record.
    """
    first, last = walk
    stop = first - max(4, round(_FLANK * (last - first)))
    start = stop - max(_LEAST_SAMPLES, round(5e-3 * sampling_rate_hz))
    stretch = force[max(0, start) : max(0, stop)]
    stretch = stretch[np.isfinite(stretch)]
    if stretch.size < _LEAST_SAMPLES:
        return level
    return RestLevel(float(np.median(stretch)), level.noise)


def _runs(mask: NDArray[np.bool_]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Starts and stops (exclusive) of the true stretches of `mask`."""
    edges = np.flatnonzero(mask[1:] != mask[:-1]) + 1
    starts = edges if not mask[0] else np.concatenate(([0], edges))
    if mask[-1]:
        starts = np.concatenate((starts, [mask.size]))
    return starts[0::2], starts[1::2]


def _peaks(force: Floats, starts: NDArray[np.int64], stops: NDArray[np.int64]) -> NDArray[np.int64]:
    peaks = np.array(
        [a + int(np.nanargmax(force[a:b])) for a, b in zip(starts, stops, strict=True)],
        dtype=np.int64,
    )
    main = int(np.argmax(force[peaks]))
    return np.concatenate((peaks[main : main + 1], np.delete(peaks, main)))


def _walk_left(force: Floats, peak: int, threshold: float) -> tuple[int, bool]:
    """Index of the last sample at or below the threshold before `peak`, and whether the record
    began first."""
    width = 64
    while True:
        low = max(0, peak - width)
        # `not >`: a NaN ends the contact, as it would end a walk
        below = np.flatnonzero(~(force[low:peak] > threshold))
        if below.size:
            return low + int(below[-1]), False
        if low == 0:
            return 0, True
        width *= 4


def _walk_right(force: Floats, peak: int, threshold: float) -> tuple[int, bool]:
    width = 64
    while True:
        high = min(force.size, peak + 1 + width)
        below = np.flatnonzero(~(force[peak + 1 : high] > threshold))
        if below.size:
            return peak + 1 + int(below[0]), False
        if high == force.size:
            return force.size - 1, True
        width *= 4


def _mask_run(force: Floats, peak: int, threshold: float) -> tuple[int, int]:
    """The run of the logical array that holds `peak`, as `diff` marks it.

    Only the neighbourhood is masked: the record's other runs belong to other contacts.
    """
    low, _ = _walk_left(force, peak, threshold)
    high, _ = _walk_right(force, peak, threshold)
    steps = np.diff((force[low : high + 1] > threshold).astype(np.int8))
    rises, falls = np.flatnonzero(steps == 1), np.flatnonzero(steps == -1)
    first = low + int(rises[0]) if rises.size else low
    last = low + int(falls[-1]) if falls.size else high
    return first, last
