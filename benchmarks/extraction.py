"""Pulse extraction beside what a user of `scipy.signal.find_peaks` would write: speed, and who is right.

Records are the virtual bench's, whose truth is known, and the shipped hit of a modal hammer. Ours also fits a spline
and measures widths, compression and impulses; the peers give contact time, peak, impulse and 20 points.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np
from pyroshock.ingest.pulses import extract_pulses
from pyroshock.ingest.readers import open_recording
from pyroshock.signals.channel import Channel, Sensor
from pyroshock.signals.checks.base import Contact
from pyroshock.signals.checks.double_hit import check_double_hit

from .figures import Figure
from .find_peaks_ways import Floats, Found, by_peak_widths, by_threshold, second_hits
from .limits import copying
from .measuring import ROOT, Spread, interleaved, ratio
from .pulse_scores import Score, Seen, score, share
from .struck_records import Struck, struck_records

THEME = "Pulses out of force records: ten seconds at 51.2 kHz, ten hits"
SHIPPED = "Pulses out of the shipped record of a modal hammer, one hit in a second at 50 kHz"
HIT = ROOT / "examples" / "modal-hammer-hit" / "recordings" / "acceleration.lvm"
_SENSOR = Sensor("force", "force", "N")


def ours(force: Floats, rate_hz: float) -> list[Seen]:
    pulses = extract_pulses(force, rate_hz)
    contacts: tuple[Contact, ...] = tuple(pulse.contact for pulse in pulses)
    doubted = {finding.contact for finding in check_double_hit(Channel(_SENSOR, force, rate_hz), contacts)}
    return [Seen(pulse.start_s, pulse.contact_time_s, i in doubted) for i, pulse in enumerate(pulses)]


def _judged(way: Callable[[Floats, float], list[Found]]) -> Callable[[Floats, float], list[Seen]]:
    def seen(force: Floats, rate_hz: float) -> list[Seen]:
        found = way(force, rate_hz)
        followed = second_hits(force, found, rate_hz)
        return [Seen(one.start_s, one.contact_time_s, again) for one, again in zip(found, followed, strict=True)]

    return seen


PEERS = {"find_peaks, peak_widths": by_peak_widths, "find_peaks, threshold": by_threshold}


def measure_pulses(_folder: Path, repeats: int = 9) -> Iterator[Figure]:
    records = list(struck_records())
    yield from _times(THEME, records, repeats, question="pulses of a force record")
    mine = [score(record, ours(record.force_n, record.rate_hz)) for record in records]
    for name, way in PEERS.items():
        theirs = [score(record, _judged(way)(record.force_n, record.rate_hz)) for record in records]
        yield from _correctness(name, records, mine, theirs)
    yield from _shipped(repeats)


def _times(theme: str, records: Sequence[Struck], repeats: int, question: str = "") -> Iterator[Figure]:
    """Of all records, without looking for second hits, which the ingest does with its other checks."""

    def over(way: Callable[[Floats, float], object]) -> Callable[[], object]:
        return lambda: [way(record.force_n, record.rate_hz) for record in records]

    copy, peers = copying(sum(record.force_n.nbytes for record in records)), {k: over(way) for k, way in PEERS.items()}
    taken = interleaved({"ours": over(extract_pulses), **peers, "copy": copy}, repeats)
    each = {name: Spread.of(seconds).text(" ms", 1e3 / len(records)) for name, seconds in taken.items()}
    for name in PEERS:
        yield Figure(
            theme, f"time for a record, {name}", each["ours"], each[name], ratio(taken["ours"], taken[name]),
            nature=f"copying the record in memory: {each['copy']}", near=ratio(taken["ours"], taken["copy"]),
            question=question, rival=name,
        )  # fmt: skip


def _correctness(
    name: str, records: Sequence[Struck], mine: Sequence[Score], theirs: Sequence[Score]
) -> Iterator[Figure]:
    hits = [hit for record in records for hit in record.hits]
    impacts, followed = len(hits), sum(hit.followed for hit in hits)
    for what, total, key in (
        ("impacts missed or made up", impacts, "miscounted"),
        ("second hits missed or made up", followed, "misjudged"),
    ):
        wrong, peers = (sum(getattr(one, key) for one in scores) for scores in (mine, theirs))
        yield Figure(
            THEME, f"{what}, {name}", f"{wrong} of {total}", f"{peers} of {total}",
            Spread.of([share(wrong, peers)]), limit=1.0, nature="none wrong", of="quality", question=what, rival=name,
        )  # fmt: skip
    own, other = (Spread.of([one.error for one in scores]) for scores in (mine, theirs))
    step = Spread.of([1 / (r.rate_hz * np.median([h.contact_time_s for h in r.hits])) / np.sqrt(6) for r in records])
    over = ratio([one.error for one in mine], [one.error for one in theirs])
    yield Figure(
        THEME, f"error of the contact time, {name}", own.text(" %", 100), other.text(" %", 100), over,
        of="quality", question="error of a contact time", rival=name,
        nature=f"both ends fall between samples: {step.text(' %', 100)}",
        near=ratio([one.error for one in mine], [step.median] * len(mine)),
    )  # fmt: skip


def _shipped(repeats: int) -> Iterator[Figure]:
    """No truth is known of it but that it is one hit."""
    with open_recording(HIT) as recording:
        name = "Force (Trigger)"
        force, rate = recording.read(name).astype(np.float64), recording.info(name).sampling_rate_hz
    record = Struck("shipped", force, [], rate)
    yield from _times(SHIPPED, [record], repeats)
    mine = ours(force, rate)
    for peer, way in PEERS.items():
        theirs = _judged(way)(force, rate)
        yield Figure(
            SHIPPED, f"pulses, contact time, {peer}", _told(mine), _told(theirs),
            Spread.of([share(abs(len(mine) - 1), abs(len(theirs) - 1))]), limit=1.0, of="quality",
            nature="it is one hit",
        )  # fmt: skip


def _told(found: Sequence[Seen]) -> str:
    return f"{len(found)}: " + ", ".join(f"{1e3 * one.contact_time_s:.3f} ms" for one in found[:3])
