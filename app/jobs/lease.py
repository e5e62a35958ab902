"""A lease: the right of one attempt at a job to write, checked where it writes and never against a clock."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from sqlalchemy import ColumnElement, update
from sqlalchemy.orm import Session

from ...schema.jobs import RUNNING, Job

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


def hold(session: Session, lease: Lease) -> None:
    """Nobody can take the job before this transaction has ended. Raises `LeaseLostError` where somebody has.

    It counts the beat on: a worker that writes lives, however long it writes, and who waits to take its job sees so.
    """
    change(session, lease, {"beat": Job.beat + 1})


def change(session: Session, lease: Lease, values: dict[str, Any]) -> None:
    """Change the job's row. Raises `LeaseLostError` where the lease is not held."""
    changed = session.execute(update(Job).where(*lease.held()).values(values), execution_options=_BLIND)
    if not changed.rowcount:  # type: ignore[attr-defined]  # SQLAlchemy types `execute` for rows only
        raise LeaseLostError(f"attempt {lease.attempt} at job {lease.job} is over")
