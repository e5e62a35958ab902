"""What the holder of a job tells its row: that it lives, how far it is, how it ended."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

from sqlalchemy import select
from sqlalchemy.orm import Session

from ...schema.base import to_plain
from ...schema.jobs import DONE, FAILED, STOPPED, WAITING, Job
from ...schema.session import Store
from .lease import Lease, LeaseLostError, change
from .work import Result


@dataclass(frozen=True)
class JobProgress:
    """How far work is; `total` 0: nobody knows."""

    done: int = 0
    total: int = 0
    what: str = ""


@dataclass(frozen=True)
class Sign:
    """What the row says back: whether the job is still this worker's, and whether a person wants it to end."""

    held: bool
    stop: bool


def beat(store: Store, lease: Lease, progress: JobProgress) -> Sign:
    """Tell that the worker lives, and how far it is."""
    columns = {"done": progress.done, "total": progress.total, "what": to_plain(progress.what)}

    def work(session: Session) -> Sign:
        with suppress(LeaseLostError):  # the sign says so
            change(session, lease, {"beat": Job.beat + 1, **columns})
        return _sign(session, lease)

    return store.write(work, idempotent=True)


def look(store: Store, lease: Lease) -> Sign:
    """Ask, and tell nothing: no writer has to wait for it."""
    return store.read(lambda session: _sign(session, lease))


def _sign(session: Session, lease: Lease) -> Sign:
    stop = session.scalar(select(Job.stop_requested).where(*lease.held()))
    return Sign(stop is not None, bool(stop))


def finish(session: Session, lease: Lease, result: Result, progress: JobProgress) -> None:
    """The job is done, in the transaction that stores the last of its work. Raises `LeaseLostError`."""
    columns = {"address": result.address, "words": result.words, "result": result.data, "what": progress.what}
    _end(session, lease, DONE, {**to_plain(columns), "done": progress.done, "total": progress.total})


def fail(store: Store, lease: Lease, why: str) -> None:
    """The job ends with an error, in words. Raises `LeaseLostError`."""
    store.write(lambda session: _end(session, lease, FAILED, {"error": to_plain(why)}))


def stopped(store: Store, lease: Lease) -> None:
    """The job ends because a person wanted it. Raises `LeaseLostError`."""
    store.write(lambda session: _end(session, lease, STOPPED, {}))


def give_back(store: Store, lease: Lease, why: str = "") -> None:
    """The job waits again, for this or another worker. Raises `LeaseLostError`."""
    again = {"state": WAITING, "what": to_plain(why), "done": 0, "total": 0}
    store.write(lambda session: change(session, lease, again))


def _end(session: Session, lease: Lease, state: str, values: dict[str, Any]) -> None:
    change(session, lease, {**values, "state": state, "ended_at": datetime.now(UTC)})
