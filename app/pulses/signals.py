"""A stored channel between two instants, as much of it as a screen can show: exact as soon as the window is short."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sqlalchemy.orm import Session

from ...array_types import Floats
from ...ingest.stored import list_channels, read_samples
from ...schema.recordings import RecordedChannel
from .envelope import FEWEST_POINTS, envelope

#: In samples: nearer to an end of the window than this is at it.
_SAME_SAMPLE = 1e-6


@dataclass(frozen=True, eq=False)
class SignalWindow:
    """Samples `first` to `stop` (exclusive) of a channel: all of them, or where `decimated` the extremes of buckets.

    `time_s` (k,) on the recording's clock, `values` (k,) in `unit`; k is 0 for a window outside of the record.
    `samples_in_record` is the whole channel's count.
    """

    channel: str
    quantity: str
    unit: str
    time_s: Floats
    values: Floats
    decimated: bool
    sampling_rate_hz: float
    first: int
    stop: int
    samples_in_record: int


def channel_window(
    session: Session,
    channel_key: int,
    start_s: float | None = None,
    stop_s: float | None = None,
    points: int = 2000,
    *,
    laboratory_unit: bool = False,
) -> SignalWindow:
    """A channel from `start_s` to `stop_s`, both included (None: the record's ends), in at most `points` samples.

    In SI, or in the laboratory's own unit. Only the chunks of the window are read. Raises `LookupError` for an unknown
    channel, `ValueError` for a window that ends before it begins or for fewer than `FEWEST_POINTS`, and
    `schema.series.SeriesError` where the stored series is damaged.
    """
    row = session.get(RecordedChannel, channel_key)
    if row is None:
        raise LookupError(f"no channel {channel_key} in the store; pyroshock show IMPACT lists those of an impact")
    if points < FEWEST_POINTS:
        raise ValueError(f"points is {points!r}; expected {FEWEST_POINTS} or more")
    first, stop = _samples(row, start_s, stop_s)
    recorded = read_samples(session, row, first, stop)
    kept = envelope(recorded, points)
    return SignalWindow(
        channel=row.name,
        quantity=row.quantity,
        unit=row.unit if laboratory_unit else row.si_unit,
        time_s=row.start_s + (first + kept) / row.sampling_rate_hz,
        values=_converted(row, recorded[kept], laboratory_unit),
        decimated=kept.size < recorded.size,
        sampling_rate_hz=row.sampling_rate_hz,
        first=first,
        stop=stop,
        samples_in_record=row.samples,
    )


def list_signals(session: Session, recording_key: int) -> list[dict[str, Any]]:
    """The channels of a recording by name, with the keys that `channel_window` takes; no sample is read."""
    return [
        {
            "key": row.id,
            "channel": row.name,
            "quantity": row.quantity,
            "unit": row.unit,
            "si_unit": row.si_unit,
            "position": row.position,
            "axis": row.axis,
            "sampling_rate_hz": row.sampling_rate_hz,
            "samples": row.samples,
            "start_s": row.start_s,
            "stop_s": row.start_s + (row.samples - 1) / row.sampling_rate_hz,
        }
        for row in list_channels(session, recording_key)
    ]


def _samples(row: RecordedChannel, start_s: float | None, stop_s: float | None) -> tuple[int, int]:
    """First sample of the window, and the one after its last: 0 <= first <= stop <= samples."""
    end_s = row.start_s + (row.samples - 1) / row.sampling_rate_hz
    start, stop = row.start_s if start_s is None else start_s, end_s if stop_s is None else stop_s
    if not (math.isfinite(start) and math.isfinite(stop)) or (start > stop and None not in (start_s, stop_s)):
        raise ValueError(f"a window from {start!r} to {stop!r} s; expected two numbers in rising order")
    first, last = ((instant - row.start_s) * row.sampling_rate_hz for instant in (start, stop))
    low = min(max(first - _SAME_SAMPLE, 0.0), float(row.samples))
    high = min(max(last + _SAME_SAMPLE, -1.0), row.samples - 1.0)
    begin = math.ceil(low)
    return begin, max(begin, math.floor(high) + 1)


def _converted(row: RecordedChannel, recorded: NDArray[Any], laboratory_unit: bool) -> Floats:
    """Recorded numbers in SI, or in the laboratory's unit."""
    values = recorded.astype(np.float64)
    if not laboratory_unit:
        return values * row.si_gain + row.si_offset
    if row.sensitivity is None:
        return values
    return (values - (row.offset_v or 0.0)) / row.sensitivity
