"""Stored channels one after another, by what a person calls them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from sqlalchemy import Connection, select

from ...campaigns import Campaign
from ...recordings import RecordedChannel, Recording
from .scope import Query, Scope

#: A channel's row, with the names of its `campaign`, `recording` and `channel`.
ChannelRow = Any

_PAGE = 500


def channels_query() -> Query:
    """What a check must know of a channel."""
    return (
        select(
            RecordedChannel.id,
            RecordedChannel.name.label("channel"),
            Campaign.name.label("campaign"),
            Recording.path.label("recording"),
            RecordedChannel.samples,
            RecordedChannel.dtype,
            RecordedChannel.chunk_samples,
            RecordedChannel.step,
            RecordedChannel.sha256,
        )
        .join(Recording, RecordedChannel.recording_id == Recording.id)
        .join(Campaign, Recording.campaign_id == Campaign.id)
    )


def iter_channels(connection: Connection, scope: Scope) -> Iterator[ChannelRow]:
    """Every channel of the scope, a page at a time: other queries may run in between."""
    query, after = scope.within(channels_query(), Recording.campaign_id).order_by(RecordedChannel.id), 0
    while page := connection.execute(query.where(RecordedChannel.id > after).limit(_PAGE)).all():
        yield from page
        after = page[-1].id


def place_of(row: ChannelRow, chunk: int | None = None) -> dict[str, Any]:
    """Campaign, recording, channel, and chunk where it is known."""
    place = {"campaign": row.campaign, "recording": row.recording, "channel": row.channel}
    return place if chunk is None else {**place, "chunk": chunk}
