"""Room that tables and indexes take, measured in two stores and carried on to a larger one."""

from __future__ import annotations

from dataclasses import dataclass

from pyroshock.schema.recordings import SeriesChunk
from pyroshock.schema.session import Store
from sqlalchemy import func, select, text

#: Of every ordinary table of the store with its TOAST, and of every index of it.
_SIZES = text(
    """
    SELECT c.relname AS "table", NULL AS "index", pg_table_size(c.oid) AS bytes
    FROM pg_class c WHERE c.relkind = 'r' AND c.relnamespace = 'public'::regnamespace
    UNION ALL
    SELECT t.relname, i.relname, pg_relation_size(i.oid)
    FROM pg_index x JOIN pg_class i ON i.oid = x.indexrelid JOIN pg_class t ON t.oid = x.indrelid
    WHERE t.relnamespace = 'public'::regnamespace
    """
)


@dataclass(frozen=True)
class Room:
    """Bytes of a table (`index` None) or of one of its indexes, in the small store and the large one."""

    table: str
    index: str | None
    small: int
    large: int


def rooms(small: Store, large: Store) -> list[Room]:
    """Every table and index, the largest first."""
    one, other = _sizes(small), _sizes(large)
    found = [Room(table, index, one.get((table, index), 0), size) for (table, index), size in other.items()]
    return sorted(found, key=lambda room: -room.large)


def frames_share(store: Store) -> float:
    """Room of the table of series over the bytes of the frames in it."""
    with store.reading() as session:
        frames = session.scalars(select(func.sum(func.length(SeriesChunk.frame)))).one()
        room = session.scalars(select(func.pg_total_relation_size(SeriesChunk.__tablename__))).one()
        return float(room) / float(frames)


def _sizes(store: Store) -> dict[tuple[str, str | None], int]:
    with store.engine.connect() as connection:
        return {(table, index): int(size) for table, index, size in connection.execute(_SIZES)}
