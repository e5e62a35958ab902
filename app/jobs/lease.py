"""A lease: the right of one attempt at a job to write, checked where it writes and never against a
clock; and the store in its hands, which writes while the lease is held, and not a row after."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, TypeVar

from sqlalchemy import ColumnElement, update
from sqlalchemy.orm import Session

from ...schema.jobs import RUNNING, Job
from ...schema.person_roles import Person
from ...schema.session import Store, Writer

#: No row of the session is looked at: it holds none of this table.
_BLIND = {"synchronize_session": False}


class LeaseLostError(Exception):
    """The job is another worker's now, or over: what this one would still write is not stored."""


@dataclass(frozen=True)
class Lease:
    """Held for as long as the job runs under this number: whoever takes the job over counts on."""

    job: int
    attempt: int

    def held(self) -> tuple[ColumnElement[bool], ...]:
        """The condition of every change that its holder makes."""
        return (Job.id == self.job, Job.attempt == self.attempt, Job.state == RUNNING)


def acquire_lease(session: Session, lease: Lease) -> None:
    """Nobody can take the job before this transaction has ended. Raises `LeaseLostError` where
    somebody has.

    It counts the beat on: a worker that writes lives, however long it writes, and who waits to take
    its job sees so.
    """
    change(session, lease, {"beat": Job.beat + 1})


def change(session: Session, lease: Lease, values: dict[str, Any]) -> None:
    """Change the job's row. Raises `LeaseLostError` where the lease is not held."""
    changed = session.execute(
        update(Job).where(*lease.held()).values(values), execution_options=_BLIND
    )
    # SQLAlchemy types `execute` for rows only
    if not changed.rowcount:  # type: ignore[attr-defined]
        raise LeaseLostError(f"attempt {lease.attempt} at job {lease.job} is over")


Result = TypeVar("Result")


class FencedStore(Store):
    """Each of its transactions begins by holding the lease; one that cannot raises
    `LeaseLostError`, nothing stored.

    For one thread. Closing it is its maker's who owns the engine.
    """

    def __init__(self, store: Store, lease: Lease, what: str, person: Person | None = None) -> None:
        """Parameters:
        person: For whom the job is done; None where nobody is known, or whoever runs this process.
        """
        super().__init__(store.engine, Writer(what, store.writer.software_version, person))
        self.lease = lease
        self._last: Session | None = None

    @contextmanager
    def reading(self) -> Iterator[Session]:
        if self._last is not None:
            yield self._last
            return
        with super().reading() as session:
            yield session

    @contextmanager
    def writing(self) -> Iterator[Session]:
        if self._last is not None:
            yield self._last
            return
        with super().writing() as session:
            acquire_lease(session, self.lease)
            yield session

    def read(self, work: Callable[[Session], Result]) -> Result:
        return super().read(work) if self._last is None else work(self._last)

    def write(self, work: Callable[[Session], Result], *, idempotent: bool = False) -> Result:
        return (
            super().write(work, idempotent=idempotent) if self._last is None else work(self._last)
        )

    def end(self, work: Callable[[Session], Result]) -> Result:
        """What `work` returns of the transaction that ends the job. All that is read and written
        meanwhile joins it, so that a row without a natural key is there exactly where the job is
        done. Run again as `Store.write` does."""

        def joined(session: Session) -> Result:
            self._last = session
            try:
                return work(session)
            finally:
                self._last = None

        return super().write(joined)
