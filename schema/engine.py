"""Engines: SQLite, the embedded default, and PostgreSQL, the laboratory's server, through the same
code."""

from __future__ import annotations

import sqlite3
import time
from errno import EDQUOT, EFBIG, ENOSPC
from pathlib import Path
from typing import Any

from sqlalchemy import URL, Connection, Engine, create_engine, event
from sqlalchemy.exc import DBAPIError, NoSuchModuleError

from .addresses import AddressError, address_for_display, parse_store_address, without_secrets
from .transactions import RetryPolicy, retry

#: Wait this long for another writer before giving up (SQLite lets one write at a time).
BUSY_TIMEOUT_S = 60.0
#: Pages of the write-ahead log that wait to be written into the file (16 MB): SQLite's own 1,000
#: are two recordings.
_LOG_PAGES = 4_000

#: Of connections to a server: who they are, in its list of activity; and a server that vanished is
#: noticed in a minute (the system's own keepalive waits two hours).
_SERVER = {
    "fallback_application_name": "pyroshock",
    "connect_timeout": 10,
    "keepalives_idle": 30,
    "keepalives_interval": 10,
    "keepalives_count": 3,
}
#: What a server says that is restarting, or has as many clients as it takes (57P03, 53300); and one
#: that refuses us.
_NEVER = (
    "does not exist",
    "authentication failed",
    "pg_hba.conf",
    "not permitted to log in",
    "permission denied",
)
_LATER = (
    "starting up",
    "shutting down",
    "recovery mode",
    "not yet accepting",
    "too many clients",
    "connection slots",
)


#: What helps where a disk is full.
MAKE_ROOM = "make room on its disk and repeat; what was stored is whole"


class StoreError(RuntimeError):
    """The store cannot be used; the message names it and the command that mends it."""


class NoStoreError(StoreError):
    """There is no store at this address yet."""


class StoreRoleError(StoreError):
    """The login may not do this; the message names the role that may."""


class StoreVersionError(StoreError):
    """The store's tables are older or newer than this software."""


def describe(engine: Engine) -> str:
    """The store's address without its password.

    Parameters:
        engine: The engine of the store.
    """
    return address_for_display(engine.url)


def first_line(error: DBAPIError) -> str:
    """What the driver said, without what it goes on to tell of itself; and what to do where a disk
    is full.

    Parameters:
        error: An error of the database, as SQLAlchemy raises it.

    Returns:
        One line, with `***` in the place of passwords and tokens.
    """
    lines = str(error.orig).strip().splitlines()
    line = without_secrets(lines[0]) if lines else type(error.orig).__name__
    return f"{line}; {MAKE_ROOM}" if _had_no_room(error.orig) else line


def disk_is_full(error: BaseException | None) -> bool:
    """Whether a system, SQLite or a PostgreSQL server had no room for what was to be written, and
    this came of it.

    Parameters:
        error: The error that was raised; those that caused it are looked at too. None gives False.
    """
    while error is not None:
        if _had_no_room(error) or _had_no_room(getattr(error, "orig", None)):
            return True
        error = error.__cause__ or error.__context__
    return False


def _had_no_room(error: BaseException | None) -> bool:
    code = getattr(error, "sqlite_errorcode", None) or 0
    return (
        getattr(error, "errno", None) in (ENOSPC, EDQUOT, EFBIG)
        or code & 0xFF == sqlite3.SQLITE_FULL
        or code == sqlite3.SQLITE_IOERR_WRITE
        or getattr(error, "sqlstate", None) == "53100"
    )


def make_engine(url: str) -> Engine:
    """An engine with the rules that the store relies on.

    Parameters:
        url: The address of the store: the path of an SQLite file, with or without `sqlite:///`, or
            a PostgreSQL address as SQLAlchemy spells it.

    Raises:
        StoreError: For an unusable address, such as one that cannot be read, a folder that does not
            exist, or a database whose driver is not installed.
    """
    try:
        parsed = parse_store_address(url)
    except AddressError as error:
        raise StoreError(str(error)) from error
    backend = parsed.get_backend_name()
    if backend not in ("sqlite", "postgresql"):
        raise StoreError(
            f"unsupported store {backend!r} in {address_for_display(url)!r}; "
            f"use sqlite:/// or postgresql+psycopg://"
        )
    if backend == "postgresql" and parsed.drivername == "postgresql":
        parsed = parsed.set(drivername="postgresql+psycopg")
    try:
        if backend == "sqlite":
            _refuse_missing_folder(Path(parsed.database or ""))
            engine = _sqlite_engine(parsed)
        else:
            engine = create_engine(parsed, pool_pre_ping=True, connect_args=dict(_SERVER))
            _configure_postgresql(engine)
    except (ModuleNotFoundError, NoSuchModuleError) as error:
        raise StoreError(
            f"no driver for {address_for_display(url)!r}: pip install 'pyroshock[postgres]'"
        ) from error
    return engine


def make_memory_engine() -> Engine:
    """An engine of an SQLite store that is gone when it is disposed of."""
    return _sqlite_engine(URL.create("sqlite", database=":memory:"))


def one_state(engine: Engine) -> dict[str, Any]:
    """Options of a transaction that only reads: it sees one state throughout, as SQLite's do by
    themselves.

    Parameters:
        engine: The engine of the store.

    Returns:
        Execution options of SQLAlchemy for a connection; none for SQLite.
    """
    if engine.dialect.name == "sqlite":
        return {}
    return {"isolation_level": "REPEATABLE READ", "postgresql_readonly": True}


def _configure_postgresql(engine: Engine) -> None:
    has_answered = False  # whether the server has ever answered: if not, its address may be wrong

    @event.listens_for(engine, "do_connect")
    def _connect(dialect: Any, _record: Any, arguments: Any, options: Any) -> Any:
        nonlocal has_answered
        connection = retry(
            lambda: dialect.connect(*arguments, **options),
            lambda error, _: (
                isinstance(error, dialect.dbapi.OperationalError)
                and _may_come(str(error), has_answered)
            ),
            RetryPolicy(BUSY_TIMEOUT_S),
        )
        has_answered = True
        return connection


def _may_come(message: str, is_known: bool) -> bool:
    """Whether a connection that failed may be had later. The driver gives no SQLSTATE to it, only
    words."""
    if is_known:
        return not any(words in message for words in _NEVER)
    return any(words in message for words in _LATER)


def _refuse_missing_folder(database: Path) -> None:
    if not database.absolute().parent.is_dir():
        raise StoreError(
            f"no folder {str(database.parent)!r} to keep the store {database.name!r} in"
        )
    if database.is_dir():
        raise StoreError(
            f"{str(database)!r} is a folder; a store is a file: give one in "
            f"it, such as {database}/lab.db"
        )


def _sqlite_engine(url: URL) -> Engine:
    engine = create_engine(url, connect_args={"timeout": BUSY_TIMEOUT_S})
    _configure_sqlite(engine)
    return engine


def _configure_sqlite(engine: Engine) -> None:
    @event.listens_for(engine, "connect")
    def _pragmas(connection: Any, _record: Any) -> None:
        connection.isolation_level = None  # transactions are ours, not the driver's guess
        cursor = connection.cursor()
        cursor.execute("PRAGMA foreign_keys = ON")
        _write_ahead(cursor)
        cursor.execute("PRAGMA synchronous = NORMAL")
        cursor.execute(f"PRAGMA wal_autocheckpoint = {_LOG_PAGES}")
        cursor.close()

    @event.listens_for(engine, "begin")
    def _begin(connection: Connection) -> None:
        # A writer takes its lock at once: a reader that turns writer can only fail.
        writes = connection.get_execution_options().get("pyroshock_writes", False)
        connection.exec_driver_sql("BEGIN IMMEDIATE" if writes else "BEGIN")


def _write_ahead(cursor: sqlite3.Cursor) -> None:
    """Write-ahead log: readers do not wait for the writer; a killed writer leaves the last whole
    transaction.

    The mode is the file's, and set once. Setting it does not wait for other connections as all else
    does, so two commands that make one store at the same moment would fail without a second try.
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
    """`make_engine`, refusing a missing SQLite file (which SQLite would silently create).

    Parameters:
        url: The address of the store, as `make_engine` takes it.

    Raises:
        NoStoreError: Where the SQLite file does not exist.
        StoreError: As `make_engine`.
    """
    engine = make_engine(url)
    if engine.dialect.name == "sqlite" and not Path(engine.url.database or "").exists():
        raise no_store(engine, url)
    return engine


def no_store(engine: Engine, url: str) -> NoStoreError:
    """What to raise where an address leads to no store.

    Parameters:
        engine: The engine of the address; the message describes it.
        url: The address as it was given, for the command that makes a store there.
    """
    return NoStoreError(
        f"no store at {describe(engine)}; make one with: pyroshock init --db "
        f"{address_for_display(url)}"
    )
