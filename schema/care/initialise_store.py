"""An empty place that becomes a store in one transaction: filled whole, or as empty as before."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from sqlalchemy import Connection, Engine, delete, func, inspect, select
from sqlalchemy.exc import DBAPIError

from ..engine import StoreError, describe
from ..migrate import MIGRATION_LOCK, make_within
from ..permission_errors import refusal
from ..tables import metadata

#: Of SQLite's pages in memory while a store is filled, in KiB: the indices are built out of order.
_CACHE_KIB = 65_536


@contextmanager
def becoming_store(engine: Engine) -> Iterator[Connection]:
    """A connection to a store without any row, which is there once the block ends well.

    A kill leaves an empty database, or an empty file with a journal that the next look at it takes back. Raises
    `StoreError` where the place holds anything.
    """
    file = _file_of(engine)
    was_there = file is not None and file.exists()
    try:
        writing = engine.execution_options(pyroshock_writes=True)
        with writing.connect() as connection:
            _refuse_full(connection, engine)  # before its journal is touched, and again once nobody else can fill it
            connection.rollback()
            _journal_beside(connection)
            with connection.begin():
                _lock_makers_out(connection)
                _refuse_full(connection, engine)
                make_within(connection)
                _empty(connection)
                yield connection
    except BaseException as error:
        engine.dispose()
        if file is not None and not was_there:
            file.unlink(missing_ok=True)
        if isinstance(error, DBAPIError):
            raise refusal(engine, error) from error
        raise


def _journal_beside(connection: Connection) -> None:
    """In place of a write-ahead log, which would hold the whole content a second time before it is in the file."""
    if connection.dialect.name == "sqlite":
        driver: Any = connection.connection
        for pragma in ("journal_mode = DELETE", "synchronous = FULL", f"cache_size = -{_CACHE_KIB}"):
            driver.execute(f"PRAGMA {pragma}")


def _lock_makers_out(connection: Connection) -> None:
    """Two commands may find the same empty place. SQLite's writers queue by themselves."""
    if connection.dialect.name == "postgresql":
        connection.execute(select(func.pg_advisory_xact_lock(MIGRATION_LOCK)))


def _refuse_full(connection: Connection, engine: Engine) -> None:
    there = inspect(connection).get_table_names()
    if there:
        what = "a store" if "alembic_version" in there else f"tables ({', '.join(sorted(there)[:3])}, …)"
        raise StoreError(f"{describe(engine)} holds {what} already; give a new file, or an empty database")


def _empty(connection: Connection) -> None:
    """Of what a migration may have put in: every row comes from elsewhere."""
    for table in reversed(metadata.sorted_tables):
        connection.execute(delete(table))


def _file_of(engine: Engine) -> Path | None:
    name = engine.url.database
    return Path(name) if engine.dialect.name == "sqlite" and name and name != ":memory:" else None
