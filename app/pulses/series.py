"""Stored series as rows for other programs, channel after channel; a damaged one is named before a row of it is out."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from sqlalchemy import select
from sqlalchemy.orm import Session

from ...ingest.stored import list_channels, read_channel
from ...schema.campaigns import Campaign
from ...schema.integrity.checks.series import damages
from ...schema.listings import get_campaign_id
from ...schema.recordings import STORED, RecordedChannel, Recording
from ...schema.series import SeriesError, iter_chunks


def series_batches(
    session: Session, campaign: str | None, recording: str | None, left_out: list[str] | None = None
) -> Iterator[dict[str, list[Any]]]:
    """Columns of the chosen recordings' samples in SI, a chunk at a time.

    Each series is verified whole by its SHA-256 first. A damaged one is left out and named in `left_out`; where that is
    None, `SeriesError` is raised instead. Raises `LookupError` for an unknown campaign or recording.
    """
    for key, path, name in _recordings(session, campaign, recording):
        for row in list_channels(session, key):
            damage = next(damages(session.connection(), row), None)
            if damage is None:
                yield from _chunks(session, row, name, path)
                continue
            message = f"campaign {name}, recording {path}, channel {row.name}: {damage.message}"
            if left_out is None:
                raise SeriesError(f"{message}; --skip-damaged leaves it out, pyroshock db check says what to do")
            left_out.append(message)


def _recordings(session: Session, campaign: str | None, recording: str | None) -> list[tuple[int, str, str]]:
    query = select(Recording.id, Recording.path, Campaign.name).join(Campaign).where(Recording.status == STORED)
    if campaign is not None:
        query = query.where(Recording.campaign_id == get_campaign_id(session, campaign))
    if recording is not None:
        query = query.where(Recording.path == recording)
    channels = [(key, path, name) for key, path, name in session.execute(query.order_by(Recording.id))]
    if recording is not None and not channels:
        raise LookupError(f"no recording {recording!r}" + (f" in campaign {campaign!r}" if campaign else ""))
    return channels


def _chunks(session: Session, row: RecordedChannel, campaign: str, recording: str) -> Iterator[dict[str, list[Any]]]:
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
