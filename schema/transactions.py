"""Work that is begun again where what stopped it passes, with growing pauses of random length,
until patience ends; writers that take turns; and rows that many writers share, found by their
natural key or added once.

SQLite lets one write at a time, so its writers take turns as it is. PostgreSQL's advisory locks are
had by number; it releases them with the transaction or the connection that took them, however that
ends.
"""

from __future__ import annotations

import hashlib
import json
import random
import sqlite3
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, TypeVar

from sqlalchemy import func, select
from sqlalchemy.exc import DBAPIError, IntegrityError
from sqlalchemy.orm import Session

from .base import Base

Result = TypeVar("Result")


@dataclass(frozen=True)
class RetryPolicy:
    """How long to go on: seconds by a clock that nobody sets, and the pauses between two
    attempts."""

    total_s: float = 120.0
    shortest_s: float = 0.02
    longest_s: float = 5.0

    def pause_s(self, attempt: int, rng: random.Random) -> float:
        """After the attempt of this number. Random, so that those who met once do not meet
        again."""
        return rng.uniform(0.5, 1.0) * min(
            self.longest_s, self.shortest_s * 2.0 ** min(attempt, 30)
        )


def retry(
    attempt: Callable[[], Result],
    again: Callable[[Exception, int], bool],
    patience: RetryPolicy = RetryPolicy(),
    *,
    sleep: Callable[[float], None] = time.sleep,
    clock: Callable[[], float] = time.monotonic,
) -> Result:
    """What `attempt` returns. An error for which `again(error, number of attempts)` holds has it
    called once more; any other, or one after `patience`, is raised."""
    deadline, number, rng = clock() + patience.total_s, 0, random.Random()
    while True:
        number += 1
        try:
            return attempt()
        except Exception as error:
            pause_s = patience.pause_s(number, rng)
            if not again(error, number) or clock() + pause_s > deadline:
                raise
        sleep(pause_s)


#: PostgreSQL's SQLSTATE: serialisation failure, deadlock, a lock not had in time, too many clients,
#: the server is not up yet, or has ended a transaction in which this process slept.
_UNDONE = frozenset({"40001", "40P01", "55P03", "53300", "57P03", "25P03"})
#: The server is shut down, or has crashed; and connection exceptions.
_LOST = ("57P01", "57P02", "08")
_UNIQUE_POSTGRESQL = "23505"
_UNIQUE_SQLITE = (sqlite3.SQLITE_CONSTRAINT_UNIQUE, sqlite3.SQLITE_CONSTRAINT_PRIMARYKEY)
_BUSY = (sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED)


def is_transient(error: BaseException) -> bool:
    """Whether the same transaction, begun again, may succeed with nothing changed but the time."""
    return any(
        _state(cause) in _UNDONE or _code(cause) & 0xFF in _BUSY or _connection_lost(cause)
        for cause in _database_errors(error)
    )


def is_disconnect(error: BaseException) -> bool:
    """Whether the connection broke: at a COMMIT nobody knows then whether it was stored."""
    return any(_connection_lost(cause) for cause in _database_errors(error))


def is_unique_violation(error: BaseException) -> bool:
    """Whether a unique key is another row's, which may have come after we had looked."""
    return isinstance(error, IntegrityError) and (
        _state(error) == _UNIQUE_POSTGRESQL or _code(error) in _UNIQUE_SQLITE
    )


def _database_errors(error: BaseException | None) -> Iterator[DBAPIError]:
    """Those that an error stands for: itself, and what it was raised from."""
    while error is not None:
        if isinstance(error, DBAPIError):
            yield error
        error = error.__cause__


def _connection_lost(error: DBAPIError) -> bool:
    """The driver gives no SQLSTATE to what the server did not say: refused, closed, timed out."""
    if error.connection_invalidated:
        return True
    state = _state(error)
    silent = (
        type(error.orig).__name__ == "OperationalError"
        and hasattr(error.orig, "sqlstate")
        and state == ""
    )
    return silent or state.startswith(_LOST)


def _state(error: DBAPIError) -> str:
    return getattr(error.orig, "sqlstate", None) or ""


def _code(error: DBAPIError) -> int:
    return getattr(error.orig, "sqlite_errorcode", None) or 0


def take_advisory_lock(session: Session, what: str) -> None:
    """Wait until nobody else's transaction has the turn called `what`; it is ours until our
    transaction ends.

    Take it first: what was read before it may have changed while waiting. One turn a transaction,
    or two transactions may wait for each other.
    """
    if session.get_bind().dialect.name == "postgresql":
        session.execute(select(func.pg_advisory_xact_lock(number_of(what))))


def number_of(what: str) -> int:
    """The name as PostgreSQL knows it: 64 bits with a sign."""
    return int.from_bytes(hashlib.sha256(f"pyroshock {what}".encode()).digest()[:8], signed=True)


Row = TypeVar("Row", bound=Base)


def fingerprint_of(content: object) -> str:
    """SHA-256 of JSON content, whatever the order of its keys: the natural key of rows that are
    sets of values."""
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def get_or_add(
    session: Session, model: type[Row], key: dict[str, Any], values: dict[str, Any] | None = None
) -> Row:
    """The row of `model` with this unique `key`, added with `values` where there is none.

    Safe against another process that adds it at the same moment: the loser of the race reads the
    winner's row.
    """
    row = session.scalars(select(model).filter_by(**key)).one_or_none()
    return add_or_get(session, model, key, values) if row is None else row


def add_or_get(
    session: Session, model: type[Row], key: dict[str, Any], values: dict[str, Any] | None = None
) -> Row:
    """`get_or_add` for a row that was just looked for, and not found."""
    if session.get_bind().dialect.name == "sqlite":  # its writer is alone: nobody can be faster
        row = model(**key, **(values or {}))
        session.add(row)
        session.flush()
        return row
    try:
        with session.begin_nested():
            row = model(**key, **(values or {}))
            session.add(row)
            session.flush()
        return row
    except IntegrityError:
        winner = session.scalars(select(model).filter_by(**key)).one_or_none()
        if winner is None:
            raise  # another rule was broken, not the key's
        return winner
