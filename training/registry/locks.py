"""One process at a time: a lock that dies with its process, on every platform that has SQLite; and
on a server's store one of its own, for machines that share it."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, closing, contextmanager
from pathlib import Path

from sqlalchemy import Connection, func, select
from sqlalchemy.exc import DBAPIError

from ...schema.engine import make_engine
from ...schema.transactions import RetryPolicy, is_transient, number_of, retry
from .model_storage import ModelStorage

#: A server that is away for longer is not waited for.
_PATIENCE = RetryPolicy(total_s=120.0)


def exclusive_lock(
    place: ModelStorage, what: str, waiting: Callable[[], None] | None = None
) -> AbstractContextManager[None]:
    """Hold the turn called `what` of the models at a place; who wants it too waits, after `waiting`
    was called once.

    A PostgreSQL store keeps it for all machines, and gives it back when the connection ends. Of
    SQLite's, and of a tracking server's, it is a file's lock, and this machine's. Not to be nested
    by one process under one name.
    """
    if place.is_postgresql:
        return _server_turn(place.tracking_uri, what, waiting)
    return locked(place.lock.with_suffix(f".{what.replace(' ', '-')}"), waiting)


@contextmanager
def _server_turn(uri: str, what: str, waiting: Callable[[], None] | None) -> Iterator[None]:
    number = number_of(what)
    engine = make_engine(uri)
    try:
        connection = retry(
            lambda: _waited(engine.connect(), number, waiting),
            lambda error, _: is_transient(error),
            _PATIENCE,
        )
        try:
            yield
        finally:
            _given_back(connection)
    finally:
        engine.dispose()


def _waited(connection: Connection, number: int, waiting: Callable[[], None] | None) -> Connection:
    """The connection, once it has the lock: a session's, so that no transaction is open
    meanwhile."""
    try:
        connection.execution_options(isolation_level="AUTOCOMMIT")
        if not connection.scalar(select(func.pg_try_advisory_lock(number))):
            if waiting is not None:
                waiting()
            connection.execute(select(func.pg_advisory_lock(number)))
    except (
        BaseException
    ):  # an interruption, too, gives the lock's connection back; it is raised again
        _given_back(connection)
        raise
    return connection


def _given_back(connection: Connection) -> None:
    """By ending the connection, be it that the server has done so already."""
    try:
        connection.invalidate()
        connection.close()
    except DBAPIError:
        pass


@contextmanager
def locked(file: Path, waiting: Callable[[], None] | None = None) -> Iterator[None]:
    """Hold `file`'s lock; another process that wants it waits, after `waiting` was called once.

    The system takes the lock back from a process that dies, however it dies. Not to be nested by
    one process.
    """
    file.parent.mkdir(parents=True, exist_ok=True)
    with closing(sqlite3.connect(file, timeout=0.0, isolation_level=None)) as connection:
        if not _is_locked(connection):
            if waiting is not None:
                waiting()
            connection.execute("PRAGMA busy_timeout = 500")
            while not _is_locked(connection):
                pass
        try:
            yield
        finally:
            connection.execute("ROLLBACK")


def _is_locked(connection: sqlite3.Connection) -> bool:
    try:
        connection.execute("BEGIN EXCLUSIVE")
    except sqlite3.OperationalError as error:
        if "locked" in str(error):
            return False
        raise
    return True
