"""What the checks find in one recording: on its channels, and in the pulses that were extracted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ...signals.channel import Channel
from ...signals.checks import run_checks
from ...signals.checks.base import Contact, Finding
from ...signals.checks.recording import check_recording_channels
from ..errors import enumerated
from .channels import total_force
from .pulses import ExtractedPulse, Hits, Touch

#: The check of a note that the pulses of a recording are negative in its force.
NEGATIVE_FORCE = "negative-force"


def check_recording(channels: list[Channel], hits: Hits) -> list[Finding]:
    """What the checks find on the channels of one recording and in its pulses, each event once."""
    contacts = tuple(pulse.contact for pulse in hits.pulses)
    force = total_force(channels)
    findings: list[Finding] = []
    for channel in channels:
        moved = contacts_on(channel, force[1] if force else channel, contacts)
        on_channel = run_checks(channel, tuple(contact for _, contact in moved))
        findings += with_numbers(on_channel, [number for number, _ in moved])
    return check_recording_channels(channels, findings + _pulse_findings(channels, hits))


def contacts_on(
    channel: Channel, force: Channel, contacts: Sequence[Contact]
) -> list[tuple[int, Contact]]:
    """Contacts of `force` as samples of `channel`, each with its number; those outside of its
    record are left out."""
    if channel.start_s == force.start_s and channel.sampling_rate_hz == force.sampling_rate_hz:
        return list(enumerate(contacts))
    last = channel.recorded.size - 1

    def place(sample: int) -> int:
        time_s = force.start_s + sample / force.sampling_rate_hz
        return round((time_s - channel.start_s) * channel.sampling_rate_hz)

    moved = [
        (i, Contact(place(c.first), place(c.peak), place(c.last))) for i, c in enumerate(contacts)
    ]
    return [
        (i, Contact(max(0, c.first), min(max(0, c.peak), last), min(c.last, last)))
        for i, c in moved
        if c.last >= 0 and c.first <= last
    ]


def with_numbers(findings: Sequence[Finding], numbers: Sequence[int]) -> list[Finding]:
    """Findings whose contacts are counted among those of a channel, by the `numbers` of these in
    the recording."""
    return [f if f.contact is None else replace(f, contact=numbers[f.contact]) for f in findings]


def _pulse_findings(channels: list[Channel], hits: Hits) -> list[Finding]:
    """What the extraction itself noticed: no contact, a hit without a row or before another one, a
    contact cut by the record's end, a raised threshold."""
    name = next((c.name for c in channels if c.quantity == "force"), None)
    if name is None:
        return []
    if not hits.pulses:
        return [
            Finding("no-contact", "reject", "no contact rises above the noise of the force", name)
        ]
    findings = hits_without_row(hits, name) + check_force_sign(hits.pulses, name)
    for i, pulse in enumerate(hits.pulses):
        findings += touches_before(pulse, i, name)
        if pulse.truncated:
            message = "the record begins or ends inside the contact"
            findings.append(
                Finding("truncated-contact", "reject", message, name, {"start_s": pulse.start_s}, i)
            )
        if pulse.threshold_raised:
            message = (
                "noise lies above the extraction's threshold, which was raised: "
                "the contact is cut short"
            )
            findings.append(
                Finding("threshold-raised", "note", message, name, {"start_s": pulse.start_s}, i)
            )
    return findings


#: From this share of the smallest hit that has a row, a hit without a row may be the row's own: the
#: largest hits are taken to be the rows', and between peaks that differ by less than a factor of
#: two their size says nothing.
DOUBTFUL_SHARE = 0.5


def hits_without_row(hits: Hits, channel: str) -> list[Finding]:
    """One finding for all hits that no row of `runs.csv` stands for: a `warning` where one of them
    is as large as those that have a row, else a `note`. The rows' hits are the largest (the
    thesis's "ten main peaks")."""
    if not hits.left_out:
        return []
    rows, smallest = len(hits.pulses), min(pulse.peak_force_n for pulse in hits.pulses)
    doubtful = max(touch.peak_force_n for touch in hits.left_out) >= DOUBTFUL_SHARE * smallest
    message = (
        f"{rows + len(hits.left_out)} hits found for {_rows(rows)} of runs.csv; "
        f"{'the largest is' if rows == 1 else 'the largest are'} stored, not "
        f"stored: {_named(hits.left_out)}"
    )
    evidence = {
        "hits": rows + len(hits.left_out),
        "rows": rows,
        "smallest_stored_peak_n": smallest,
        "left_out": _evidence(hits.left_out),
    }
    return [
        Finding("hit-without-row", "warning" if doubtful else "note", message, channel, evidence)
    ]


def touches_before(pulse: ExtractedPulse, contact: int, channel: str) -> list[Finding]:
    """A contact before the hit that belongs to the same swing; `signals.checks.double_hit` looks
    for those after it."""
    if not pulse.earlier_touches:
        return []
    message = (
        f"before this hit of {pulse.peak_force_n:.4g} N the force shows "
        f"{_named(pulse.earlier_touches)}"
    )
    evidence = {"peak_force_n": pulse.peak_force_n, "earlier": _evidence(pulse.earlier_touches)}
    return [Finding("double-hit", "warning", message, channel, evidence, contact)]


def _rows(number: int) -> str:
    return "1 row" if number == 1 else f"{number} rows"


def _named(touches: tuple[Touch, ...]) -> str:
    """Some of them; all are in the evidence."""
    return enumerated([f"{touch.peak_force_n:.3g} N at {touch.time_s:.4g} s" for touch in touches])


def _evidence(touches: tuple[Touch, ...]) -> list[dict[str, float]]:
    return [{"time_s": touch.time_s, "peak_force_n": touch.peak_force_n} for touch in touches]


def check_force_sign(pulses: Sequence[ExtractedPulse], channel: str) -> list[Finding]:
    """A `note` where the pulses of a recording are negative in its force."""
    if not pulses or pulses[0].sign > 0:
        return []
    message = (
        "the force of the contact is negative in this recording; the pulses are stored upright"
    )
    return [Finding(NEGATIVE_FORCE, "note", message, channel, {"sign": -1})]
