"""The accelerations of one impact, cut out of a recording of several impacts."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from sqlalchemy import select
from sqlalchemy.orm import Session

from ....array_types import Floats
from ....ingest.extraction.channel_figures import parts_between
from ....ingest.storing.stored_channels import list_channels, read_channel
from ....schema.impacts import Impact, Pulse
from ....schema.recordings import RecordedChannel
from ....signals.record_rest import without_rest
from .impact import get_impact


@dataclass(frozen=True, eq=False)
class ImpactRecord:
    """A channel's record of one impact, (n,), less its rest; `start_s` on the recording's clock."""

    impact: int
    channel: str
    values_m_s2: Floats
    rate_hz: float
    start_s: float


def impact_records(
    session: Session, key: int, channel: str | None, left_out: list[str]
) -> Iterator[ImpactRecord]:
    """The acceleration channels of an impact (or the one named `channel`), between its neighbours
    in the recording.

    A recording of one impact is taken whole, else from the rest before this contact up to that of
    the next one, as an ingest divides it. The rest before the shock is its zero, where there is
    one. What there is not is added to `left_out`. `LookupError` for an unknown impact.
    """
    impact = get_impact(session, key)
    rows = [] if impact.recording_id is None else list_channels(session, impact.recording_id)
    rows = [row for row in rows if row.quantity == "acceleration" and channel in (None, row.name)]
    if not rows:
        left_out.append(
            f"impact {key}: no acceleration"
            + (f" {channel!r}" if channel else "")
            + " was recorded"
        )
        return
    begin_s, end_s = _window(session, impact)
    for row in rows:
        first = (
            max(0, math.ceil((begin_s - row.start_s) * row.sampling_rate_hz))
            if begin_s > -math.inf
            else 0
        )
        stop = row.samples
        if end_s < math.inf:
            stop = min(stop, math.ceil((end_s - row.start_s) * row.sampling_rate_hz))
        if stop - first < 2:
            left_out.append(
                f"impact {key}: {row.name} has no samples between this contact and the next"
            )
            continue
        yield ImpactRecord(key, row.name, *_values(session, row, first, stop))


def _values(
    session: Session, row: RecordedChannel, first: int, stop: int
) -> tuple[Floats, float, float]:
    samples = read_channel(session, row, first, stop)
    return (
        without_rest(samples.readings, row.sampling_rate_hz, samples.start_s)[0],
        row.sampling_rate_hz,
        samples.start_s,
    )


def _window(session: Session, impact: Impact) -> tuple[float, float]:
    """When an impact's own stretch of the recording begins and ends; infinite where it has the
    recording alone."""
    query = (
        select(Pulse.impact_id, Pulse.start_s)
        .join(Impact, Pulse.impact_id == Impact.id)
        .where(Impact.recording_id == impact.recording_id, Pulse.current)
        .order_by(Pulse.start_s)
    )
    starts: dict[int, float] = dict(iter(session.execute(query)))
    if len(starts) < 2 or impact.id not in starts or impact.recording_id is None:
        return -math.inf, math.inf
    onsets = sorted(starts.values())
    rate_hz = min(row.sampling_rate_hz for row in list_channels(session, impact.recording_id))
    return parts_between(onsets, [onsets.index(starts[impact.id])], rate_hz)[0]
