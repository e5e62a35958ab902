"""What the holder of a job tells its row: that it lives (by a thread that beats and hears of a
stop), how far it is, how it ended."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

from sqlalchemy import select
from sqlalchemy.exc import SQLAlchemyError
from sqlalchemy.orm import Session

from ...schema.base import to_plain
from ...schema.engine import StoreError
from ...schema.job_results import kept
from ...schema.jobs import DONE, FAILED, STOPPED, WAITING, Job
from ...schema.session import Store
from .kind import InterruptedWorkError, JobResult, StoppedError
from .lease import Lease, LeaseLostError, change


@dataclass(frozen=True)
class JobProgress:
    """How far work is; `total` 0: nobody knows."""

    done: int = 0
    total: int = 0
    what: str = ""


@dataclass(frozen=True)
class Sign:
    """What the row says back: whether the job is still this worker's, and whether a person wants it
    to end."""

    held: bool
    stop: bool


def send_heartbeat(store: Store, lease: Lease, progress: JobProgress) -> Sign:
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


def finish(session: Session, lease: Lease, result: JobResult, progress: JobProgress) -> None:
    """The job is done, in the transaction that stores the last of its work. Raises
    `LeaseLostError`."""
    columns = {
        "address": result.address,
        "words": result.words,
        "result": kept(result.data, result.whole),
        "what": progress.what,
    }
    _end(
        session, lease, DONE, {**to_plain(columns), "done": progress.done, "total": progress.total}
    )


#: Writes what else belongs to the end of a job, in the transaction that ends it.
Record = Callable[[Session], None]


def _nothing_else(_: Session) -> None:
    pass


def fail(
    store: Store, lease: Lease, why: str, fault: str = "", record: Record = _nothing_else
) -> None:
    """The job ends with an error, in words, of this kind (`kept_result.fault_of`). Raises
    `LeaseLostError`."""
    columns = {"error": to_plain(why), **({"result": kept(None, None, fault)} if fault else {})}
    store.write(lambda session: _end(session, lease, FAILED, columns, record))


def stopped(store: Store, lease: Lease, record: Record = _nothing_else) -> None:
    """The job ends because a person wanted it. Raises `LeaseLostError`."""
    store.write(lambda session: _end(session, lease, STOPPED, {}, record))


def give_back(store: Store, lease: Lease, why: str = "") -> None:
    """The job waits again, for this or another worker. Raises `LeaseLostError`."""
    again = {"state": WAITING, "what": to_plain(why), "done": 0, "total": 0}
    store.write(lambda session: change(session, lease, again))


def _end(
    session: Session,
    lease: Lease,
    state: str,
    values: dict[str, Any],
    record: Record = _nothing_else,
) -> None:
    change(session, lease, {**values, "state": state, "ended_at": datetime.now(UTC)})
    record(session)


#: A lease is kept by so many beats: some may come late, on a machine that is busy or a store that
#: is locked.
_BEATS = 6
#: A stop is heard of, and progress told, within this time.
_TICK_S = 1.0


class Heartbeat:
    """Beats for as long as it is entered. `step` tells progress, and raises what ends the work."""

    def __init__(
        self, store: Store, lease: Lease, lease_s: float, ending: threading.Event, stop: bool
    ) -> None:
        self.progress = JobProgress()
        self._store, self._lease, self._ending = store, lease, ending
        self._beat_s = lease_s / _BEATS
        self._sign = Sign(True, stop)
        self._over = threading.Event()
        self._thread = threading.Thread(
            target=self._run, name=f"pyroshock job {lease.job}", daemon=True
        )

    def __enter__(self) -> Heartbeat:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        self._thread.join()

    def step(self, done: int, total: int, what: str) -> None:
        """Raises `LeaseLostError`, `StoppedError`, `InterruptedWorkError`."""
        self.progress = JobProgress(done, total, what)
        self.check()

    def check(self) -> None:
        """Raises as `step`."""
        sign = self._sign
        if not sign.held:
            raise LeaseLostError(f"job {self._lease.job} was taken over")
        if sign.stop:
            raise StoppedError
        if self._ending.is_set():
            raise InterruptedWorkError

    def _run(self) -> None:
        last_written, beaten = JobProgress(), time.monotonic()
        while self._sign.held and not self._over.wait(min(_TICK_S, self._beat_s)):
            now, progress = time.monotonic(), self.progress
            try:
                if progress != last_written or now - beaten >= self._beat_s:
                    self._sign = send_heartbeat(self._store, self._lease, progress)
                    last_written, beaten = progress, now
                else:
                    self._sign = look(self._store, self._lease)
            except (StoreError, SQLAlchemyError):
                # out of reach for the moment; if for too long, the next answer is that the lease is
                # lost
                continue
