"""One process at a time: a lock that dies with its process, on every platform that has SQLite."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path


@contextmanager
def locked(file: Path, waiting: Callable[[], None] | None = None) -> Iterator[None]:
    """Hold `file`'s lock; another process that wants it waits, after `waiting` was called once.

    The system takes the lock back from a process that dies, however it dies. Not to be nested by one process.
    """
    file.parent.mkdir(parents=True, exist_ok=True)
    with closing(sqlite3.connect(file, timeout=0.0, isolation_level=None)) as connection:
        if not _taken(connection):
            if waiting is not None:
                waiting()
            connection.execute("PRAGMA busy_timeout = 500")
            while not _taken(connection):
                pass
        try:
            yield
        finally:
            connection.execute("ROLLBACK")


def _taken(connection: sqlite3.Connection) -> bool:
    try:
        connection.execute("BEGIN EXCLUSIVE")
    except sqlite3.OperationalError as error:
        if "locked" in str(error):
            return False
        raise
    return True
