"""The accelerations of one impact, cut out of a recording that may hold several."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from sqlalchemy import select
from sqlalchemy.orm import Session

from ...array_types import Floats
from ...ingest.stored import list_channels, read_channel
from ...schema.impacts import Impact, Pulse
from ...schema.recordings import RecordedChannel
from .impact import get_impact

#: Of a hit among others in a recording: rest before its contact, and what is kept clear of the next one.
REST_S, CLEAR_S = 1e-3, 1e-3
#: Of a record, what is taken for rest: the tuner's share.
_QUIET = 0.1


@dataclass(frozen=True, eq=False)
class ImpactRecord:
    """A channel's record of one impact, (n,), less its rest; `start_s` on the recording's clock."""

    impact: int
    channel: str
    values_m_s2: Floats
    rate_hz: float
    start_s: float


def impact_records(session: Session, key: int, channel: str | None, left_out: list[str]) -> Iterator[ImpactRecord]:
    """The acceleration channels of an impact (or the one named `channel`), between its neighbours in the recording.

    A recording of one impact is taken whole, else from the rest before this contact up to the next one. Its first
    tenth, or that rest, is its zero. What there is not is added to `left_out`. `LookupError` for an unknown impact.
    """
    impact = get_impact(session, key)
    rows = [] if impact.recording_id is None else list_channels(session, impact.recording_id)
    rows = [row for row in rows if row.quantity == "acceleration" and channel in (None, row.name)]
    if not rows:
        left_out.append(f"impact {key}: no acceleration" + (f" {channel!r}" if channel else "") + " was recorded")
        return
    begin_s, end_s = _window(session, impact)
    for row in rows:
        first = max(0, math.ceil((begin_s - row.start_s) * row.sampling_rate_hz)) if begin_s > -math.inf else 0
        stop = row.samples
        if end_s < math.inf:
            stop = min(stop, math.floor((end_s - row.start_s) * row.sampling_rate_hz) + 1)
        if stop - first < 2:
            left_out.append(f"impact {key}: {row.name} has no samples between this contact and the next")
            continue
        yield ImpactRecord(key, row.name, *_values(session, row, first, stop, begin_s))


def _values(
    session: Session, row: RecordedChannel, first: int, stop: int, begin_s: float
) -> tuple[Floats, float, float]:
    read = read_channel(session, row, first, stop)
    alone = begin_s == -math.inf
    quiet = int(_QUIET * read.si.size) if alone else round(REST_S * row.sampling_rate_hz)
    return read.si - np.median(read.si[: max(1, quiet)]), row.sampling_rate_hz, read.start_s


def _window(session: Session, impact: Impact) -> tuple[float, float]:
    """When an impact's own stretch of the recording begins and ends; infinite where it has the recording alone."""
    query = (
        select(Pulse.impact_id, Pulse.start_s)
        .join(Impact, Pulse.impact_id == Impact.id)
        .where(Impact.recording_id == impact.recording_id, Pulse.current)
        .order_by(Pulse.start_s)
    )
    starts: dict[int, float] = dict(iter(session.execute(query)))
    if len(starts) < 2 or impact.id not in starts:
        return -math.inf, math.inf
    start_of_impact = starts[impact.id]
    later = [start for start in starts.values() if start > start_of_impact]
    return start_of_impact - REST_S, min(later) - CLEAR_S if later else math.inf
