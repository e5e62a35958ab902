"""A stored channel between two instants, as few points as a screen can show: the least and the
largest sample of each bucket. Means or every n-th sample would show a shock too small.

Series as rows for other programs, channel after channel; a damaged one is named before a row of it
is out.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import select
from sqlalchemy.orm import Session

from ....array_types import Floats
from ....ingest.storing.stored_channels import list_channels, read_channel, read_samples
from ....schema.campaigns import Campaign
from ....schema.integrity.checks.series import damages
from ....schema.listings import get_campaign_id
from ....schema.recordings import STORED, RecordedChannel, Recording
from ....schema.series import SeriesError, iter_chunks

#: First, last, and the two extremes of one bucket.
FEWEST_POINTS = 4


def envelope(values: NDArray[Any], points: int) -> NDArray[np.intp]:
    """Indices, rising, of at most `points` samples of `values` (n,) that keep its outline; all
    where they fit.

    The first and the last sample are kept, and of every bucket (`bucket_length` consecutive
    samples) the first of its least and of its largest ones. A bucket with samples that are no
    numbers keeps the extremes of the others; one without any number keeps one sample, so that a
    long gap stays a gap. Raises `ValueError` below `FEWEST_POINTS`.
    """
    length = bucket_length(values.size, points)
    if length == 1:
        return np.arange(values.size, dtype=np.intp)
    whole = values.size // length
    ends = np.array([0, values.size - 1], dtype=np.intp)
    parts = [ends, *_extremes(values[: whole * length].reshape(whole, length), 0)]
    if values.size % length:
        parts += _extremes(values[whole * length :].reshape(1, -1), whole * length)
    return np.unique(np.concatenate(parts))


def bucket_length(samples: int, points: int) -> int:
    """Samples per bucket of a series of `samples` that `points` shall show; 1 where all fit."""
    if points < FEWEST_POINTS:
        raise ValueError(f"points is {points!r}; expected {FEWEST_POINTS} or more")
    return 1 if samples <= points else -(-samples // ((points - 2) // 2))


def _extremes(rows: NDArray[Any], origin: int) -> list[NDArray[np.intp]]:
    """Indices of the least and the largest of each row (k, m) of a series that begins at
    `origin`."""
    low = high = rows
    if np.issubdtype(rows.dtype, np.inexact) and (gaps := np.isnan(rows)).any():
        low, high = np.where(gaps, np.inf, rows), np.where(gaps, -np.inf, rows)
    starts = origin + np.arange(len(rows), dtype=np.intp) * rows.shape[1]
    return [starts + low.argmin(axis=1), starts + high.argmax(axis=1)]


#: In samples: nearer to an end of the window than this is at it.
_SAME_SAMPLE = 1e-6


@dataclass(frozen=True, eq=False)
class SignalWindow:
    """Samples `first` to `stop` (exclusive) of a channel: all of them, or where `decimated` the
    extremes of buckets.

    `time_s` (k,) on the recording's clock, `values` (k,) in `unit`; k is 0 for a window outside of
    the record. `samples_in_record` is the whole channel's count.
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
    """A channel from `start_s` to `stop_s`, both included (None: the record's ends), in at most
    `points` samples.

    In SI, or in the laboratory's own unit. Only the chunks of the window are read. Raises
    `LookupError` for an unknown channel, `ValueError` for a window that ends before it begins or
    for fewer than `FEWEST_POINTS`, and `schema.series.SeriesError` where the stored series is
    damaged.
    """
    row = session.get(RecordedChannel, channel_key)
    if row is None:
        raise LookupError(
            f"no channel {channel_key} in the store; pyroshock show IMPACT lists those of an impact"
        )
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


def _samples(row: RecordedChannel, start_s: float | None, stop_s: float | None) -> tuple[int, int]:
    """First sample of the window, and the one after its last: 0 <= first <= stop <= samples."""
    end_s = row.start_s + (row.samples - 1) / row.sampling_rate_hz
    start, stop = row.start_s if start_s is None else start_s, end_s if stop_s is None else stop_s
    if not (math.isfinite(start) and math.isfinite(stop)) or (
        start > stop and None not in (start_s, stop_s)
    ):
        raise ValueError(
            f"a window from {start!r} to {stop!r} s; expected two numbers in rising order"
        )
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


def series_batches(
    session: Session, campaign: str | None, recording: str | None, left_out: list[str] | None = None
) -> Iterator[dict[str, list[Any]]]:
    """Columns of the chosen recordings' samples in SI, a chunk at a time.

    Each series is verified whole by its SHA-256 first. A damaged one is left out and named in
    `left_out`; where that is None, `SeriesError` is raised instead. Raises `LookupError` for an
    unknown campaign or recording.
    """
    for key, path, name in _recordings(session, campaign, recording):
        for row in list_channels(session, key):
            damage = next(damages(session.connection(), row), None)
            if damage is None:
                yield from _chunks(session, row, name, path)
                continue
            message = f"campaign {name}, recording {path}, channel {row.name}: {damage.message}"
            if left_out is None:
                raise SeriesError(
                    f"{message}; --skip-damaged leaves it out, pyroshock db check says what to do"
                )
            left_out.append(message)


def _recordings(
    session: Session, campaign: str | None, recording: str | None
) -> list[tuple[int, str, str]]:
    query = (
        select(Recording.id, Recording.path, Campaign.name)
        .join(Campaign)
        .where(Recording.status == STORED)
    )
    if campaign is not None:
        query = query.where(Recording.campaign_id == get_campaign_id(session, campaign))
    if recording is not None:
        query = query.where(Recording.path == recording)
    channels = [
        (key, path, name) for key, path, name in session.execute(query.order_by(Recording.id))
    ]
    if recording is not None and not channels:
        raise LookupError(
            f"no recording {recording!r}" + (f" in campaign {campaign!r}" if campaign else "")
        )
    return channels


def _chunks(
    session: Session, row: RecordedChannel, campaign: str, recording: str
) -> Iterator[dict[str, list[Any]]]:
    for start, stop in iter_chunks(row.samples, row.chunk_samples):
        channel = read_channel(session, row, start, stop)
        size, at = stop - start, np.arange(start, stop, dtype=np.float64)
        yield {
            "campaign": [campaign] * size,
            "recording": [recording] * size,
            "channel": [row.name] * size,
            "time_s": (row.start_s + at / row.sampling_rate_hz).tolist(),
            "value": channel.si.tolist(),
            "unit": [row.si_unit] * size,
        }
