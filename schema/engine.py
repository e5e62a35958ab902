"""Engines: SQLite, the embedded default, and PostgreSQL, the laboratory's server, through the same code."""

from __future__ import annotations

import sqlite3
import time
from pathlib import Path
from typing import Any

from sqlalchemy import Connection, Engine, create_engine, event, make_url
from sqlalchemy.exc import ArgumentError, DBAPIError, NoSuchModuleError

#: Wait this long for another writer before giving up (SQLite lets one write at a time).
BUSY_TIMEOUT_S = 60.0


class StoreError(RuntimeError):
    """The store cannot be used; the message names it and the command that mends it."""


class StoreVersionError(StoreError):
    """The store's tables are older or newer than this software."""


def describe(engine: Engine) -> str:
    """The store's address without its password."""
    return engine.url.render_as_string(hide_password=True)


def first_line(error: DBAPIError) -> str:
    return str(error.orig).strip().splitlines()[0] if str(error.orig).strip() else type(error.orig).__name__


def make_engine(url: str) -> Engine:
    """An engine with the rules that the store relies on. Raises `StoreError` for an unusable address."""
    try:
        parsed = make_url(url)
    except ArgumentError as error:
        raise StoreError(
            f"unreadable store address {url!r}; expected sqlite:///FILE.db or postgresql+psycopg://HOST/NAME"
        ) from error
    backend = parsed.get_backend_name()
    if backend not in ("sqlite", "postgresql"):
        raise StoreError(f"unsupported store {backend!r} in {url!r}; use sqlite:/// or postgresql+psycopg://")
    if backend == "postgresql" and parsed.drivername == "postgresql":
        parsed = parsed.set(drivername="postgresql+psycopg")
    try:
        if backend == "sqlite":
            _refuse_missing_folder(parsed.database)
            engine = create_engine(parsed, connect_args={"timeout": BUSY_TIMEOUT_S})
            _configure_sqlite(engine)
        else:
            engine = create_engine(parsed, pool_pre_ping=True)
    except (ModuleNotFoundError, NoSuchModuleError) as error:
        raise StoreError(f"no driver for {url!r}: pip install 'pyroshock[postgres]'") from error
    return engine


def _refuse_missing_folder(database: str | None) -> None:
    if database and database != ":memory:" and not Path(database).absolute().parent.is_dir():
        raise StoreError(f"no folder {str(Path(database).parent)!r} to keep the store {Path(database).name!r} in")


def _configure_sqlite(engine: Engine) -> None:
    @event.listens_for(engine, "connect")
    def _pragmas(connection: Any, _record: Any) -> None:
        connection.isolation_level = None  # transactions are ours, not the driver's guess
        cursor = connection.cursor()
        cursor.execute("PRAGMA foreign_keys = ON")
        _write_ahead(cursor)
        cursor.execute("PRAGMA synchronous = NORMAL")
        cursor.close()

    @event.listens_for(engine, "begin")
    def _begin(connection: Connection) -> None:
        # A writer takes its lock at once: a reader that turns writer can only fail.
        writes = connection.get_execution_options().get("pyroshock_writes", False)
        connection.exec_driver_sql("BEGIN IMMEDIATE" if writes else "BEGIN")


def _write_ahead(cursor: sqlite3.Cursor) -> None:
    """Write-ahead log: readers do not wait for the writer; a killed writer leaves the last whole transaction.

    The mode is the file's, and set once. Setting it does not wait for other connections as all else does, so two
    commands that make one store at the same moment would fail without a second try.
    """
    deadline = time.monotonic() + BUSY_TIMEOUT_S
    while True:
        try:
            cursor.execute("PRAGMA journal_mode = WAL")
            return
        except sqlite3.OperationalError as error:
            if error.sqlite_errorcode & 0xFF != sqlite3.SQLITE_BUSY or time.monotonic() > deadline:
                raise
            time.sleep(0.01)


def make_engine_of_existing(url: str) -> Engine:
    """`make_engine`, refusing a missing SQLite file (which SQLite would silently create)."""
    engine = make_engine(url)
    path = engine.url.database
    if engine.dialect.name == "sqlite" and path and path != ":memory:" and not Path(path).exists():
        raise StoreError(f"no store at {describe(engine)}; make one with: pyroshock init --db {url}")
    return engine
