"""Every series is the one that was recorded: as many chunks as its samples take, and the SHA-256 of
all samples."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from sqlalchemy import Connection, func, select

from ...campaigns import Campaign
from ...recordings import RecordedChannel, Recording, SeriesChunk
from ...series import LONGEST_CHUNK, SeriesError, SeriesHash, SeriesLayout, iter_chunks, read_slice
from ..findings import IntegrityFinding, Scope

#: A channel's row, with the names of its `campaign`, `recording` and `channel`.
ChannelRow = Any

_PAGE = 500


def iter_channels(connection: Connection, scope: Scope) -> Iterator[ChannelRow]:
    """What a check must know of every channel of the scope."""
    query = (
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
    return scope.iter_rows(connection, query, Recording.campaign_id, RecordedChannel.id, _PAGE)


def place_of(row: ChannelRow, chunk: int | None = None) -> dict[str, Any]:
    """Campaign, recording, channel, and chunk where it is known."""
    place = {"campaign": row.campaign, "recording": row.recording, "channel": row.channel}
    return place if chunk is None else {**place, "chunk": chunk}


ADVICE = (
    "read the recording again from its campaign folder with: pyroshock db check --repair FOLDER; "
    "without the folder, restore the store from its backup. All other series can be used"
)


@dataclass(frozen=True)
class Damage:
    """What is wrong with a series; `chunk` is None where nobody can tell which."""

    message: str
    chunk: int | None = None


def check_series(connection: Connection, scope: Scope) -> Iterator[IntegrityFinding]:
    """Series of which a chunk is missing, damaged or too many, or whose samples are not those that
    were stored."""
    for row in iter_channels(connection, scope):
        for damage in damages(connection, row):
            yield IntegrityFinding("series", damage.message, ADVICE, place_of(row, damage.chunk))
        scope.bar.step(row.samples, f"{row.campaign}, {row.recording}")


def damages(connection: Connection, row: ChannelRow) -> Iterator[Damage]:
    """What is wrong with one series, read chunk by chunk; nothing for a whole one."""
    refused = _implausible(row)
    if refused is not None:
        yield Damage(refused)
        return
    layout, lost = SeriesLayout(row.dtype, row.chunk_samples, row.step), False
    digest = SeriesHash(np.dtype(row.dtype), row.samples)
    for number, (start, stop) in enumerate(iter_chunks(row.samples, row.chunk_samples)):
        try:
            digest.update(read_slice(connection, row.id, layout, start, stop))
        except SeriesError as error:
            lost = True
            yield Damage(str(error), number)
    yield from _too_many(connection, row)
    if not lost and digest.hex != row.sha256:
        yield Damage(
            f"its samples have the SHA-256 {digest.hex[:12]}…, recorded were {row.sha256[:12]}…"
        )


def _implausible(row: ChannelRow) -> str | None:
    """Why the row cannot be of a series: looked at before anything is decoded by its word."""
    try:
        dtype = np.dtype(row.dtype)
    except (TypeError, ValueError, SyntaxError):
        return f"its dtype is {row.dtype!r:.40}"
    if dtype.kind not in "iuf" or dtype.str != row.dtype:
        return f"its dtype is {row.dtype!r:.40}; expected that of a number"
    if not 0 < row.chunk_samples <= LONGEST_CHUNK or row.samples < 1:
        return (
            f"{row.samples} samples in chunks of {row.chunk_samples}; expected at "
            f"most {LONGEST_CHUNK} in one"
        )
    return None


def _too_many(connection: Connection, row: ChannelRow) -> Iterator[Damage]:
    expected = -(-row.samples // row.chunk_samples)
    beyond = select(func.count()).where(
        SeriesChunk.channel_id == row.id, ~SeriesChunk.number.between(0, expected - 1)
    )
    if count := connection.scalar(beyond):
        yield Damage(f"{count} chunks beyond the {expected} of its {row.samples} samples")


def check_chunks(connection: Connection, scope: Scope) -> Iterator[IntegrityFinding]:
    """Channels with another number of chunks: what `check_series` finds of gaps, without reading
    any."""
    chunks = func.count(SeriesChunk.channel_id)
    length = RecordedChannel.chunk_samples
    expected = (RecordedChannel.samples + length - 1) // length
    query = (
        select(
            Campaign.name,
            Recording.path,
            RecordedChannel.name,
            chunks,
            RecordedChannel.samples,
            length,
        )
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
        yield IntegrityFinding(
            "series", f"{frames} chunks; expected {-(-samples // long)}", ADVICE, place
        )
