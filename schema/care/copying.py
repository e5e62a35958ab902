"""`pyroshock db copy`: a whole store from one engine to another, rows and keys as they are."""

from __future__ import annotations

from dataclasses import dataclass

from sqlalchemy import Connection, Engine, Table, func, select

from ..engine import StoreError, describe
from ..session import Store
from ..tables import metadata
from .engine_limits import refuse_unholdable
from .initialise_store import becoming_store
from .progress import Progress, ProgressBar
from .sequences import set_sequences
from .transfer import transfer, verify


@dataclass(frozen=True)
class CopiedTable:
    """A table that is the same on both sides: its rows, and the SHA-256 of their content."""

    name: str
    rows: int
    sha256: str


def copy_store(source: Store, target: Engine, progress: Progress | None = None) -> list[CopiedTable]:
    """Copy a store into the empty place at `target`.

    The source is read in one state; the target is a store once all of it is there, read back and found equal. Raises
    `StoreError` otherwise, and leaves the target empty.
    """
    with source.reading() as session, becoming_store(target) as copy:
        origin = session.connection()
        tables = metadata.sorted_tables
        counts = {table.name: _count(origin, table) for table in tables}
        for table in tables:
            _refuse(source, origin, table, copy.dialect.name)
        bar = ProgressBar(progress, 2 * sum(counts.values()))
        written = {table.name: transfer(origin, copy, table, bar) for table in tables}
        set_sequences(copy)
        for table in tables:
            verify(copy, table, written[table.name], bar)
        return [CopiedTable(name, digest.rows, digest.hex) for name, digest in written.items()]


def _count(connection: Connection, table: Table) -> int:
    return connection.scalar(select(func.count()).select_from(table)) or 0


def _refuse(source: Store, origin: Connection, table: Table, engine: str) -> None:
    try:
        refuse_unholdable(origin, table, engine)
    except StoreError as error:
        raise StoreError(f"{describe(source.engine)}: {error}") from error
