"""Every channel has as many chunks as its samples take: counted, not read."""

from __future__ import annotations

from collections.abc import Iterator

from sqlalchemy import Connection, func, select

from ...campaigns import Campaign
from ...recordings import RecordedChannel, Recording, SeriesChunk
from ..findings import IntegrityFinding
from .scope import Scope
from .series import ADVICE


def check_chunks(connection: Connection, scope: Scope) -> Iterator[IntegrityFinding]:
    """Channels with another number of chunks: what `check_series` finds of gaps, without reading any."""
    chunks = func.count(SeriesChunk.channel_id)
    length = RecordedChannel.chunk_samples
    expected = (RecordedChannel.samples + length - 1) // length
    query = (
        select(Campaign.name, Recording.path, RecordedChannel.name, chunks, RecordedChannel.samples, length)
        .join(Recording, RecordedChannel.recording_id == Recording.id)
        .join(Campaign, Recording.campaign_id == Campaign.id)
        .outerjoin(SeriesChunk, SeriesChunk.channel_id == RecordedChannel.id)
        .group_by(RecordedChannel.id, Recording.id, Campaign.id)
        .having(chunks != expected)
    )
    for campaign, recording, channel, frames, samples, long in connection.execute(
        scope.within(query, Recording.campaign_id)
    ):
        place = {"campaign": campaign, "recording": recording, "channel": channel}
        yield IntegrityFinding("series", f"{frames} chunks; expected {-(-samples // long)}", ADVICE, place)
