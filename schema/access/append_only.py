"""What the software itself must change of records that an operator may only add to.

On PostgreSQL functions of the store do it, with their owner's rights and within what they check
(`migrations`); in a file of SQLite, whose owner may do all, the same statements.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from sqlalchemy import Connection, delete, func, select, update

from ..recordings import SET_ASIDE, QualityFinding, RecordedChannel, Recording, SeriesChunk
from ..row_hashes import row_hash
from ..row_sealing import iter_hashed


def delete_set_aside(connection: Connection, recording: int) -> int:
    """Delete a recording that was set aside; how many were: 0 for one that is stored, or gone."""
    if _has_functions(connection):
        return int(connection.scalar(select(func.pyroshock_delete_set_aside(recording))) or 0)
    rows = (Recording.id == recording, Recording.status == SET_ASIDE)
    return int(connection.execute(delete(Recording).where(*rows)).rowcount)


def replace_set_aside(connection: Connection, recording: int, values: Mapping[str, Any]) -> int:
    """Give a recording that was set aside other facts: `sha256`, `size_bytes`, `format`, `status`,
    `reason` and `written_by_id`. How many were changed: 0 for one that is stored, or gone."""
    if not _has_functions(connection):
        rows = (Recording.id == recording, Recording.status == SET_ASIDE)
        return int(connection.execute(update(Recording).where(*rows).values(**values)).rowcount)
    table = Recording.__table__
    here = connection.execute(select(table).where(Recording.id == recording)).mappings().one()
    names = ("sha256", "size_bytes", "format", "status", "reason", "written_by_id")
    new_hash = row_hash(table, {**here, **values})  # type: ignore[arg-type]
    call = func.pyroshock_replace_set_aside(recording, *(values[name] for name in names), new_hash)
    return int(connection.scalar(select(call)) or 0)


def delete_damaged_chunks(connection: Connection, channel: int) -> int:
    """Delete the chunks of a series that are not as they were written, by their row's SHA-256, or
    beyond its samples; how many were."""
    if _has_functions(connection):
        return int(connection.scalar(select(func.pyroshock_delete_damaged_chunks(channel))) or 0)
    facts = select(RecordedChannel.samples, RecordedChannel.chunk_samples).where(
        RecordedChannel.id == channel
    )
    samples, chunk_samples = connection.execute(facts).one()
    own = SeriesChunk.channel_id == channel
    damaged = [
        row.values["number"]
        for rows in iter_hashed(connection, SeriesChunk.__table__, own)  # type: ignore[arg-type]
        for row in rows
        if row.recorded != row.computed or not 0 <= row.values["number"] * chunk_samples < samples
    ]
    if damaged:
        connection.execute(delete(SeriesChunk).where(own, SeriesChunk.number.in_(damaged)))
    return len(damaged)


def withdraw_findings(connection: Connection, recording: int, check: str) -> None:
    """Delete what a check said of a recording in comparison with others, which say something else
    by now."""
    if _has_functions(connection):
        connection.execute(
            select(getattr(func, f"pyroshock_withdraw_{check.replace('-', '_')}")(recording))
        )
        return
    old = (QualityFinding.recording_id == recording, QualityFinding.check == check)
    connection.execute(delete(QualityFinding).where(*old))


def _has_functions(connection: Connection) -> bool:
    return connection.dialect.name == "postgresql"
