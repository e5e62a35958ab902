"""The channels of one recording, judged together: one finding for one event, and no blame for a
quiet cross-axis."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from ..channel import Channel
from .base import Finding

SEVERITIES = ("note", "warning", "reject")
#: What one check tells of a channel -> what others would tell of the same event.
TELLS_ALREADY: dict[str, tuple[str, ...]] = {
    "no-shock": ("pre-trigger-noise", "zero-shift", "velocity", "displacement", "truncation"),
    "no-contact": (
        "pre-trigger-noise",
        "zero-shift",
        "rest-level",
        "velocity",
        "displacement",
        "truncation",
    ),
    "rest-level": ("zero-shift", "velocity", "displacement"),
    "zero-shift": ("velocity", "displacement"),
    "velocity": ("displacement",),
}
#: The same for findings of the same contact: full scale is why the top is flat.
TELLS_OF_CONTACT: dict[str, tuple[str, ...]] = {"saturation": ("clipping",)}
#: An axis whose peak is below this share of the loudest one's beside it is a quiet one: -20 dB,
#: more than the cross sensitivity of accelerometers (5 %).
QUIET_SHARE = 0.1
#: What a quiet axis cannot help: its noise and its rest are large beside a small peak.
OF_QUIET_AXES = ("no-shock", "pre-trigger-noise", "rest-level", "zero-shift")


def check_recording_channels(
    channels: Sequence[Channel], findings: Iterable[Finding]
) -> list[Finding]:
    """`findings` of all `channels`, each event once, those of a quiet cross-axis as notes."""
    kept = merge_findings(list(findings))
    louder = {
        channel.name: _louder(channel, channels)
        for channel in channels
        if channel.quantity == "acceleration"
    }
    return [_softened(finding, louder.get(finding.channel)) for finding in kept]


def merge_findings(findings: Sequence[Finding]) -> list[Finding]:
    """Without those that tell again what another finding of the channel told, at least as gravely.
    A channel that never moves has one."""
    dead = {
        f.channel for f in findings if f.check == "dropouts" and f.evidence.get("kind") == "dead"
    }
    return [
        finding
        for finding in findings
        if not any(_tells(teller, finding) for teller in findings)
        and (finding.channel not in dead or finding.check in ("dropouts", "no-contact"))
    ]


def _tells(teller: Finding, finding: Finding) -> bool:
    """Whether `teller` told what `finding` tells."""
    if teller.channel != finding.channel or SEVERITIES.index(teller.severity) < SEVERITIES.index(
        finding.severity
    ):
        return False
    same_contact = teller.contact == finding.contact and finding.check in TELLS_OF_CONTACT.get(
        teller.check, ()
    )
    return same_contact or finding.check in TELLS_ALREADY.get(teller.check, ())


def _softened(finding: Finding, louder: str | None) -> Finding:
    if louder is None or finding.severity == "note" or finding.check not in OF_QUIET_AXES:
        return finding
    message = f"{finding.message}; a quiet cross-axis of {louder}, which saw the shock"
    return replace(
        finding,
        severity="note",
        message=message,
        evidence={**finding.evidence, "louder_axis": louder},
    )


def _louder(channel: Channel, channels: Sequence[Channel]) -> str | None:
    """The other axis of the same sensor that saw ten times as much; None where there is none."""
    own_peak = _peak(channel)
    beside = [c for c in channels if c is not channel and _same_sensor(c, channel)]
    loudest = max(beside, key=_peak, default=None)
    return None if loudest is None or own_peak > QUIET_SHARE * _peak(loudest) else loudest.name


def _same_sensor(channel: Channel, other: Channel) -> bool:
    """Two accelerations at one position along different axes; where no axis is given, names that
    differ in a last x, y or z alone."""
    if channel.quantity != "acceleration" or channel.quantity != other.quantity:
        return False
    if (channel.sensor.position or "").strip().lower() != (
        other.sensor.position or ""
    ).strip().lower():
        return False
    if channel.sensor.axis and other.sensor.axis:
        return channel.sensor.axis.strip().lower() != other.sensor.axis.strip().lower()
    ends = channel.name[-1:].lower(), other.name[-1:].lower()
    return channel.name[:-1] == other.name[:-1] and ends[0] != ends[1] and set(ends) <= set("xyz")


def _peak(channel: Channel) -> float:
    """Half of the swing: an offset is no shock."""
    finite = channel.readings[np.isfinite(channel.readings)]
    return float(np.ptp(finite)) / 2.0 if finite.size else 0.0
