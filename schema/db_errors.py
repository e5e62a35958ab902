"""What stops a transaction and passes by itself, told apart from what stays wrong however often one tries."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator

from sqlalchemy.exc import DBAPIError, IntegrityError

#: PostgreSQL's SQLSTATE: serialisation failure, deadlock, a lock not had in time, too many clients, the server is not
#: up yet, or has ended a transaction in which this process slept.
_UNDONE = frozenset({"40001", "40P01", "55P03", "53300", "57P03", "25P03"})
#: The server is shut down, or has crashed; and connection exceptions.
_LOST = ("57P01", "57P02", "08")
_UNIQUE_POSTGRESQL = "23505"
_UNIQUE_SQLITE = (sqlite3.SQLITE_CONSTRAINT_UNIQUE, sqlite3.SQLITE_CONSTRAINT_PRIMARYKEY)
_BUSY = (sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED)


def passes(error: BaseException) -> bool:
    """Whether the same transaction, begun again, may succeed with nothing changed but the time."""
    return any(
        _state(cause) in _UNDONE or _code(cause) & 0xFF in _BUSY or _lost(cause) for cause in _database_errors(error)
    )


def lost(error: BaseException) -> bool:
    """Whether the connection broke: at a COMMIT nobody knows then whether it was stored."""
    return any(_lost(cause) for cause in _database_errors(error))


def taken(error: BaseException) -> bool:
    """Whether a unique key is another row's, which may have come after we had looked."""
    return isinstance(error, IntegrityError) and (_state(error) == _UNIQUE_POSTGRESQL or _code(error) in _UNIQUE_SQLITE)


def _database_errors(error: BaseException | None) -> Iterator[DBAPIError]:
    """Those that an error stands for: itself, and what it was raised from."""
    while error is not None:
        if isinstance(error, DBAPIError):
            yield error
        error = error.__cause__


def _lost(error: DBAPIError) -> bool:
    """The driver gives no SQLSTATE to what the server did not say: refused, closed, timed out."""
    if error.connection_invalidated:
        return True
    state = _state(error)
    silent = type(error.orig).__name__ == "OperationalError" and hasattr(error.orig, "sqlstate") and state == ""
    return silent or state.startswith(_LOST)


def _state(error: DBAPIError) -> str:
    return getattr(error.orig, "sqlstate", None) or ""


def _code(error: DBAPIError) -> int:
    return getattr(error.orig, "sqlite_errorcode", None) or 0
