"""One impact's segmentation as a page draws it: the force about the contact, and each version of the pulse over it.

All forces are at the record's own level, turned so that compression is positive: a version's spline lies on the record
that it was cut from, and `rest_n` less it is the pulse that the store holds.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from sqlalchemy import select
from sqlalchemy.orm import Session, undefer

from ...array_types import Floats
from ...ingest.processing import total_force
from ...ingest.pulses import ExtractedPulse
from ...ingest.segmentation import RestLevel, orientation, record_rest
from ...ingest.settings import ExtractionSettings
from ...ingest.stored import list_channels, read_channel
from ...schema.impacts import Pulse as PulseRow
from ...signals.channel import Channel
from .curves import ForceRecord, PulseCurve, preview_curve
from .envelope import envelope
from .impact import get_impact

#: A contact has tens to hundreds of samples; one of very many is shown by its outline.
MOST_POINTS = 20_000


@dataclass(frozen=True, eq=False)
class PulseView:
    """The record about a contact, `time_s` and `force_n` (n,), and the versions of its pulse, by their keys.

    `channels` are the force channels (cells of an array are summed); `sign` is -1 where the record shows compression
    as negative. `preview` is what other settings would make of it.
    """

    impact: int
    recording: str
    channels: tuple[str, ...]
    sampling_rate_hz: float
    sign: int
    time_s: Floats
    force_n: Floats
    versions: tuple[PulseCurve, ...]
    preview: PulseCurve | None


def pulse_view(
    session: Session, impact_key: int, preview: tuple[ExtractedPulse, ExtractionSettings] | None = None
) -> PulseView:
    """The segmentation of an impact; `preview` is drawn beside it (`ingest.reextract.preview_impacts` makes them).

    Raises `LookupError` for an unknown impact, and for one without pulse or force record.
    """
    impact = get_impact(session, impact_key)
    rows = session.scalars(
        select(PulseRow)
        .where(PulseRow.impact_id == impact_key)
        .options(undefer(PulseRow.fine_force_n))
        .order_by(PulseRow.id)
    ).all()
    channels = list(_force_channels(session, impact.recording_id))
    force = total_force(channels)
    if not rows or force is None or impact.recording is None:
        raise LookupError(f"impact {impact_key} has no pulse with a force record to show")
    recorded, channel = force
    level = record_rest(recorded)
    sign = orientation(recorded, level)
    record = ForceRecord(sign * recorded, channel, RestLevel(sign * level.baseline, level.noise))
    versions = tuple(record.stored(row) for row in rows)
    shown = None if preview is None else preview_curve(*preview)
    span = record.span([*versions, *([shown] if shown else [])])
    kept = span.start + envelope(record.upright[span], MOST_POINTS)
    return PulseView(
        impact=impact_key,
        recording=impact.recording.path,
        channels=tuple(channel.name for channel in channels),
        sampling_rate_hz=channel.sampling_rate_hz,
        sign=sign,
        time_s=channel.start_s + kept / channel.sampling_rate_hz,
        force_n=record.upright[kept],
        versions=versions,
        preview=shown,
    )


def _force_channels(session: Session, recording: int | None) -> Iterator[Channel]:
    if recording is not None:
        for row in list_channels(session, recording):
            if row.quantity == "force":
                yield read_channel(session, row)
