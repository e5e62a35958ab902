"""Where in a record a quality finding is: the times that its evidence names.

Checks write times as `first_time_s` with `longest_s` (runs of samples), `start_s` (the begin of a
contact), lists of `time_s` (hits and shocks that no row stands for), all on the recording's clock,
and `second_sample` (a second hit), which counts the channel's samples. A finding without any of
them concerns its contact where it has one, else the whole record.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

from sqlalchemy import or_, select
from sqlalchemy.orm import Session

from ....schema.impacts import Pulse
from ....schema.recordings import QualityFinding, RecordedChannel
from .impact import get_impact

Extent = Literal["times", "contact", "record"]


@dataclass(frozen=True)
class RecordPlace:
    """From `start_s` to `stop_s` on the recording's clock; equal for an instant."""

    start_s: float
    stop_s: float


@dataclass(frozen=True)
class PlacedFinding:
    """A finding and what it concerns: the `places` that its evidence names, the contact, or the
    whole record, which has none. `channel` is None for a finding of the whole recording."""

    severity: str
    check: str
    channel: str | None
    message: str
    extent: Extent
    places: tuple[RecordPlace, ...]


def list_placed_findings(session: Session, impact_key: int) -> list[PlacedFinding]:
    """The findings of an impact and of its recording as a whole, in the order of the checks.

    Parameters:
        session: Open for reading.
        impact_key: The impact's key.

    Raises:
        LookupError: The store has no such impact.
    """
    impact = get_impact(session, impact_key)
    if impact.recording_id is None:
        return []
    pulse = session.execute(
        select(Pulse.start_s, Pulse.contact_time_s).where(
            Pulse.impact_id == impact_key, Pulse.current
        )
    ).one_or_none()
    contact = None if pulse is None else RecordPlace(pulse[0], pulse[0] + pulse[1])
    query = (
        select(QualityFinding, RecordedChannel)
        .outerjoin(RecordedChannel, QualityFinding.channel_id == RecordedChannel.id)
        .where(
            QualityFinding.recording_id == impact.recording_id,
            or_(QualityFinding.impact_id == impact_key, QualityFinding.impact_id.is_(None)),
        )
        .order_by(QualityFinding.id)
    )
    findings = []
    for row, channel in session.execute(query):
        places = evidence_places(row.evidence, channel)
        extent: Extent = "times" if places else "record"
        if not places and row.impact_id is not None and contact is not None:
            extent, places = "contact", (contact,)
        name = None if channel is None else channel.name
        findings.append(PlacedFinding(row.severity, row.check, name, row.message, extent, places))
    return findings


def evidence_places(
    evidence: Mapping[str, Any], channel: RecordedChannel | None
) -> tuple[RecordPlace, ...]:
    """The places that the evidence of a finding names, none where it names no time.

    Parameters:
        evidence: As the check stored it, SI with the unit in the key.
        channel: The channel of the finding, whose samples `second_sample` counts.
    """
    if "first_time_s" in evidence:
        first = float(evidence["first_time_s"])
        # the length of the longest run is known, which is this one where there is no other
        length = float(evidence.get("longest_s", 0.0)) if evidence.get("runs", 1) == 1 else 0.0
        return (RecordPlace(first, first + length),)
    if "start_s" in evidence:
        instants = [float(evidence["start_s"])]
    elif "second_sample" in evidence and channel is not None:
        count = int(evidence["second_sample"])
        instants = [channel.start_s + count / channel.sampling_rate_hz]
    else:
        lists = [part for part in evidence.values() if isinstance(part, list)]
        instants = [
            float(entry["time_s"])
            for part in lists
            for entry in part
            if isinstance(entry, dict) and "time_s" in entry
        ]
    return tuple(RecordPlace(instant, instant) for instant in instants)
