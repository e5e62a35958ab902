"""`pyroshock db copy`: a whole store from one engine to another, rows and keys as they are. The
empty place becomes a store in one transaction, each table is read back and compared, and values
that the other engine cannot keep are found before."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sqlalchemy import (
    BigInteger,
    Column,
    ColumnElement,
    Connection,
    Engine,
    Table,
    delete,
    func,
    inspect,
    select,
)
from sqlalchemy.exc import DBAPIError

from ..access.permissions import refusal
from ..column_kinds import INTEGER, JSON_TEXT, NUMBER, TEXT, kind_of
from ..engine import StoreError, describe
from ..migrate import MIGRATION_LOCK, make_within
from ..rows import Progress, ProgressBar, TableDigest, iter_batches, load, set_sequences
from ..session import Store
from ..tables import metadata

_LARGEST = 2**31 - 1


def check_engine_limits(connection: Connection, table: Table, engine: str) -> None:
    """Look for rows of a table that another engine cannot keep.

    Parameters:
        connection: A connection to the store that holds the rows.
        table: The table of the rows.
        engine: The engine that the rows are copied to, "sqlite" or "postgresql".

    Raises:
        StoreError: Where a row holds what the engine cannot; the message names column and value.
    """
    if connection.dialect.name == engine:
        return
    suspects = list((_postgres_cannot if engine == "postgresql" else _sqlite_cannot)(table))
    if not suspects:
        return
    counts = connection.execute(
        select(*(func.count().filter(rule) for _, rule, _ in suspects)).select_from(table)
    ).one()
    for (column, _, what), count in zip(suspects, counts, strict=True):
        if count:
            raise StoreError(
                f"{table.name}.{column.name} holds {what} "
                f"in {count} rows, which {engine} cannot keep"
            )


def _sqlite_cannot(table: Table) -> Iterator[tuple[Column[Any], ColumnElement[bool], str]]:
    for column in table.columns:
        if kind_of(column) == NUMBER:
            yield column, column == float("nan"), "NaN"


def _postgres_cannot(table: Table) -> Iterator[tuple[Column[Any], ColumnElement[bool], str]]:
    for column in table.columns:
        kind = kind_of(column)
        if kind == INTEGER and not isinstance(column.type, BigInteger) and not column.foreign_keys:
            yield column, ~column.between(-_LARGEST - 1, _LARGEST), f"a number beyond {_LARGEST}"
        elif kind in (TEXT, JSON_TEXT):
            yield column, func.instr(column, func.char(0)) > 0, "a NUL character"


#: Of SQLite's pages in memory while a store is filled, in KiB: the indices are built out of order.
_CACHE_KIB = 65_536


@contextmanager
def initialise_store(engine: Engine) -> Iterator[Connection]:
    """A connection to a store without any row, which is there once the block ends well.

    A kill leaves an empty database, or an empty file with a journal that the next look at it takes
    back.

    Parameters:
        engine: The engine of the empty place. A file of SQLite may be missing.

    Raises:
        StoreError: Where the place holds anything.
    """
    file = _file_of(engine)
    was_there = file is not None and file.exists()
    try:
        writing = engine.execution_options(pyroshock_writes=True)
        with writing.connect() as connection:
            _refuse_full(
                connection, engine
            )  # before its journal is touched, and again once nobody else can fill it
            connection.rollback()
            _journal_beside(connection)
            with connection.begin():
                _lock_makers_out(connection)
                _refuse_full(connection, engine)
                make_within(connection)
                _empty(connection)
                yield connection
    except (
        BaseException
    ) as error:  # an interruption, too, leaves no half copy behind; it is raised again below
        engine.dispose()
        if file is not None and not was_there:
            file.unlink(missing_ok=True)
        if isinstance(error, DBAPIError):
            raise refusal(engine, error) from error
        raise


def _journal_beside(connection: Connection) -> None:
    """In place of a write-ahead log, which would hold the whole content a second time before it is
    in the file."""
    if connection.dialect.name == "sqlite":
        driver: Any = connection.connection
        for pragma in (
            "journal_mode = DELETE",
            "synchronous = FULL",
            f"cache_size = -{_CACHE_KIB}",
        ):
            driver.execute(f"PRAGMA {pragma}")


def _lock_makers_out(connection: Connection) -> None:
    """Two commands may find the same empty place. SQLite's writers queue by themselves."""
    if connection.dialect.name == "postgresql":
        connection.execute(select(func.pg_advisory_xact_lock(MIGRATION_LOCK)))


def _refuse_full(connection: Connection, engine: Engine) -> None:
    there = inspect(connection).get_table_names()
    if there:
        what = (
            "a store"
            if "alembic_version" in there
            else f"tables ({', '.join(sorted(there)[:3])}, …)"
        )
        raise StoreError(
            f"{describe(engine)} holds {what} already; give a new file, or an empty database"
        )


def _empty(connection: Connection) -> None:
    """Of what a migration may have put in: every row comes from elsewhere."""
    for table in reversed(metadata.sorted_tables):
        connection.execute(delete(table))


def _file_of(engine: Engine) -> Path | None:
    name = engine.url.database
    return Path(name) if engine.dialect.name == "sqlite" and name else None


def transfer(
    origin: Connection,
    copy: Connection,
    table: Table,
    bar: ProgressBar,
    where: ColumnElement[bool] | None = None,
) -> TableDigest:
    """Copy the rows of a table as they are.

    Parameters:
        origin: A connection to the store that is read.
        copy: A connection to the store that is written, whose table is empty.
        table: The table of the rows.
        bar: Is told of each row that was copied.
        where: The condition of the rows that are copied; by default all are.

    Returns:
        What was read, as a digest.

    Raises:
        StoreError: Where the other store refuses a row.
    """
    digest = TableDigest()
    try:
        load(
            copy,
            table,
            bar.watch(digest.watch(iter_batches(origin, table, where)), f"copying {table.name}"),
        )
    except StoreError as error:
        raise StoreError(f"{error}; look at the source with: pyroshock db check") from error
    return digest


def verify(copy: Connection, table: Table, written: TableDigest, bar: ProgressBar) -> None:
    """Read a table back and compare it with what was written to it.

    Parameters:
        copy: A connection to the store that was written.
        table: The table that is read back.
        written: The digest of what was written.
        bar: Is told of each row that was read.

    Raises:
        StoreError: Where the table does not hold what was written to it.
    """
    digest = TableDigest().take(bar.watch(iter_batches(copy, table), f"verifying {table.name}"))
    if digest != written:
        raise StoreError(
            f"table {table.name} does not read back as it was copied ({digest.rows} rows of "
            f"{written.rows}); nothing is kept"
        )


@dataclass(frozen=True)
class CopiedTable:
    """A table that is the same on both sides: its rows, and the SHA-256 of their content."""

    name: str
    rows: int
    sha256: str


def copy_store(
    source: Store, target: Engine, progress: Progress | None = None
) -> list[CopiedTable]:
    """Copy a store into an empty place.

    The source is read in one state; the target is a store once all of it is there, read back and
    found equal.

    Parameters:
        source: The open store that is read.
        target: The engine of the empty place.
        progress: Called with (done, total, what), in rows that are copied and then read back; by
            default progress is not reported.

    Raises:
        StoreError: Where the place is not empty or the copy is not equal; the target is then left
            empty.
    """
    with source.reading() as session, initialise_store(target) as copy:
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
        check_engine_limits(origin, table, engine)
    except StoreError as error:
        raise StoreError(f"{describe(source.engine)}: {error}") from error
