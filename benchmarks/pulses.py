"""Pulse extraction beside what a user of `scipy.signal.find_peaks` would write: speed, and who is
right.

Records are the virtual bench's, whose truth is known. Ours also fits a spline and measures widths,
compression and impulses; the peers give contact time, peak, impulse and 20 points.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pyroshock.ingest.extraction.pulses import extract_pulses
from pyroshock.signals.channel import Channel, Sensor
from pyroshock.signals.checks.double_hit import check_double_hit

from .harness import Figure, beside, compared, copying, take_turns
from .shared_records import ForceRecord, force_records

Floats = NDArray[np.float64]

THEME = "Pulses out of force records: ten seconds at 51.2 kHz, ten hits"
#: An impact is found where a pulse begins so near to it.
NEAR_S = 5e-3
#: As ours by default: events above a tenth of the largest, contacts down to 0.5 % of the peak, 0.1
#: s between swings.
EVENT_SHARE, END_SHARE, INTERVAL_S = 0.1, 0.005, 0.1
#: What the peers call a second hit: from 5 % of the first, a millisecond after it at least.
SECOND_SHARE, SECOND_INTERVAL_S, POINTS = 0.05, 1e-3, 20


@dataclass(frozen=True)
class DetectedPulse:
    """A pulse as any way reports it; `followed` by a second hit."""

    start_s: float
    contact_time_s: float
    followed: bool


def ours(force: Floats, rate_hz: float) -> list[DetectedPulse]:
    pulses = extract_pulses(force, rate_hz)
    channel = Channel(Sensor("force", "force", "N"), force, rate_hz)
    doubted = {
        finding.contact
        for finding in check_double_hit(channel, tuple(pulse.contact for pulse in pulses))
    }
    return [
        DetectedPulse(pulse.start_s, pulse.contact_time_s, i in doubted)
        for i, pulse in enumerate(pulses)
    ]


@dataclass(frozen=True)
class PeerPulse:
    """One pulse of a peer; its points (20,) are equidistant over the contact."""

    start_s: float
    contact_time_s: float
    peak_force_n: float
    impulse_n_s: float
    points_n: Floats


def by_peak_widths(force: Floats, rate_hz: float) -> list[PeerPulse]:
    """`find_peaks`, then `peak_widths` at 99.5 % of the prominence: ten lines from the manual."""
    from scipy.signal import find_peaks, peak_widths

    peaks, _ = find_peaks(
        force, height=EVENT_SHARE * force.max(), distance=round(INTERVAL_S * rate_hz)
    )
    _, _, left_end, right = peak_widths(force, peaks, rel_height=1 - END_SHARE)
    return [
        _peer_pulse(force, *ends, rate_hz)
        for ends in zip(peaks, left_end.tolist(), right.tolist(), strict=True)
    ]


def by_threshold(force: Floats, rate_hz: float) -> list[PeerPulse]:
    """`find_peaks` on the record less its median, then outward from each peak to the first sample
    below the share."""
    from scipy.signal import find_peaks

    force, reach, pulses = force - np.median(force), round(INTERVAL_S * rate_hz), []
    for peak in find_peaks(force, height=EVENT_SHARE * force.max(), distance=reach)[0]:
        low, high = max(0, peak - reach), min(force.size, peak + reach)
        below = low + np.flatnonzero(force[low:high] <= END_SHARE * force[peak])
        before, after = below[below < peak], below[below > peak]
        ends = before[-1] if before.size else low, after[0] if after.size else high - 1
        pulses.append(_peer_pulse(force, peak, *ends, rate_hz))
    return pulses


def _peer_pulse(force: Floats, peak: int, left: float, right: float, rate_hz: float) -> PeerPulse:
    inside = np.arange(int(np.floor(left)), int(np.ceil(right)) + 1)
    points = np.interp(np.linspace(left, right, POINTS), inside, force[inside])
    impulse = float(np.trapezoid(force[inside], dx=1 / rate_hz))
    return PeerPulse(left / rate_hz, (right - left) / rate_hz, float(force[peak]), impulse, points)


def with_second_hits(
    force: Floats, pulses: Sequence[PeerPulse], rate_hz: float
) -> list[DetectedPulse]:
    """Whether `find_peaks` sees another peak within 0.1 s after a contact."""
    from scipy.signal import find_peaks

    detected, distance = [], max(1, round(SECOND_INTERVAL_S * rate_hz))
    for pulse in pulses:
        end = round((pulse.start_s + pulse.contact_time_s) * rate_hz)
        after, height = (
            force[end : end + round(INTERVAL_S * rate_hz)],
            SECOND_SHARE * pulse.peak_force_n,
        )
        peaks, _ = find_peaks(after, height=height, prominence=height, distance=distance)
        detected.append(DetectedPulse(pulse.start_s, pulse.contact_time_s, bool(peaks.size)))
    return detected


PEERS: dict[str, Callable[[Floats, float], list[PeerPulse]]] = {
    "find_peaks, peak_widths": by_peak_widths,
    "find_peaks, threshold": by_threshold,
}


@dataclass(frozen=True)
class Score:
    """Of one record: impacts and second hits that were missed or made up, error of the contact time
    (rms, a share)."""

    miscounted: int
    misjudged: int
    error: float


def score(record: ForceRecord, pulses: Sequence[DetectedPulse]) -> Score:
    starts = np.array([pulse.start_s for pulse in pulses])
    matched, errors, misjudged = set[int](), list[float](), 0
    for hit in record.hits:
        near = int(np.abs(starts - hit.start_s).argmin()) if starts.size else -1
        if near < 0 or abs(starts[near] - hit.start_s) > NEAR_S:
            misjudged += hit.followed
            continue
        matched.add(near)
        if not hit.chatters:
            errors.append(pulses[near].contact_time_s / hit.contact_time_s - 1)
            misjudged += pulses[near].followed != hit.followed
    wrong = len(record.hits) - len(matched) + len(pulses) - len(matched)
    return Score(
        wrong, misjudged, float(np.sqrt(np.mean(np.square(errors)))) if errors else float("inf")
    )


def measure_pulses(_folder: Path, repeats: int = 9) -> Iterator[Figure]:
    records = list(force_records())

    def all_records(method: Callable[[Floats, float], object]) -> Callable[[], object]:
        return lambda: [method(record.force_n, record.rate_hz) for record in records]

    functions = {"ours": all_records(extract_pulses)} | {
        name: all_records(method) for name, method in PEERS.items()
    }
    functions["bound"] = copying(sum(record.force_n.nbytes for record in records))
    seconds = {
        name: [s / len(records) for s in taken]
        for name, taken in take_turns(functions, repeats).items()
    }
    for name in PEERS:
        bound, question = "copying the record in memory", "pulses of a force record"
        yield beside(
            THEME, f"time for a record, {name}", seconds, name, bound=bound, question=question
        )
    our_scores = [score(record, ours(record.force_n, record.rate_hz)) for record in records]
    for name, method in PEERS.items():
        theirs = [
            score(r, with_second_hits(r.force_n, method(r.force_n, r.rate_hz), r.rate_hz))
            for r in records
        ]
        yield from _correctness(name, records, our_scores, theirs)


def _correctness(
    name: str, records: Sequence[ForceRecord], mine: Sequence[Score], theirs: Sequence[Score]
) -> Iterator[Figure]:
    hits = [hit for record in records for hit in record.hits]
    for what, key, total in (
        ("impacts missed or made up", "miscounted", len(hits)),
        ("second hits missed or made up", "misjudged", sum(hit.followed for hit in hits)),
    ):
        wrong, peers = (
            [float(sum(getattr(score, key) for score in scores))] for scores in (mine, theirs)
        )
        yield compared(
            THEME, f"{what}, {name}, of {total}", wrong, peers, "", limit=1.0, kind="quality",
            question=what,
            peer_name=name, bound="none is wrong",
        )  # fmt: skip
    steps = [
        1 / (r.rate_hz * np.median([h.contact_time_s for h in r.hits])) / np.sqrt(6)
        for r in records
    ]
    yield compared(
        THEME, f"error of the contact time, {name}", [x.error for x in mine],
        [x.error for x in theirs],
        "%", kind="quality", question="error of a contact time", peer_name=name,
        bound="both ends of a contact lie between samples",
        bound_values=[float(np.median(steps))] * len(mine),
    )  # fmt: skip
