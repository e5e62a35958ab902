"""A worker: takes the oldest job that it can do, does it, takes the next; and picks up what a dead
one has left.

A job is given up for dead when it was seen unmoved for the whole of its lease by this process's own
stopwatch. No time of day enters, neither of this machine nor of another: clocks that differ, or are
set back, change nothing.
"""

from __future__ import annotations

import logging
import os
import threading
import time
import uuid
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

from sqlalchemy.exc import SQLAlchemyError
from sqlalchemy.orm import Session

from ...schema.addresses import without_secrets
from ...schema.audit import DONE, FAILED, STOPPED
from ...schema.engine import StoreError, StoreRoleError
from ...schema.session import Store
from ...schema.transactions import is_transient
from ..common.errors import is_for_the_user
from ..common.model_registry import MissingExtraError
from ..operations.operation import NotHereError
from .asking import asking_person, record_of
from .claims import (
    MOST_DEATHS,
    Claimed,
    Sighting,
    WorkerIdentity,
    after,
    claim_waiting,
    mark_dead,
    running,
    take_over,
    tidy_up,
)
from .heartbeat import Heartbeat, fail, finish, give_back, stopped
from .kept_result import fault_of
from .kind import InterruptedWorkError, RunningJob, StoppedError
from .known_kinds import KINDS
from .lease import FencedStore, LeaseLostError
from .queue import this_host

_log = logging.getLogger("pyroshock.jobs")


@dataclass(frozen=True)
class WorkerContext:
    """Where a worker works: its store with its address, the folders that it may read, and when it
    is to end."""

    store: Store
    db: str
    lease_s: float
    folders: tuple[Path, ...] = ()
    ending: threading.Event = field(default_factory=threading.Event)


def attempt(bench: WorkerContext, claimed: Claimed) -> bool:
    """Do a job. Whether it is out of this worker's hands for good: False where it must be left to
    another one.

    Raises nothing but what ends the process (the job goes back first) and `StoreError` where the
    store is away.
    """
    lease = claimed.lease
    try:
        _do(bench, claimed)
    except LeaseLostError as error:
        _log.warning("%s; nothing more of it is stored", error)
        return True
    except StoppedError:
        _ended(claimed, lambda: stopped(bench.store, lease, record_of(claimed, STOPPED)))
    except (NotHereError, MissingExtraError) as error:
        _handed_back(bench, claimed, f"waits for another worker: {error}")
        return False
    except InterruptedWorkError:
        _handed_back(bench, claimed)
    except Exception as error:
        if isinstance(error, StoreError) and is_transient(
            error
        ):  # the store's trouble, not the job's
            _handed_back(bench, claimed)
            raise
        words, fault = _words(error), fault_of(error) if is_for_the_user(error) else ""
        record = record_of(claimed, FAILED, words)
        _ended(claimed, lambda: fail(bench.store, lease, words, fault, record))
    except BaseException:  # an interruption, too, hands the job back; it is raised again
        _handed_back(bench, claimed)
        raise
    else:
        after(claimed.kind, claimed.arguments, claimed.host)
    return True


def _do(bench: WorkerContext, claimed: Claimed) -> None:
    lease = claimed.lease
    person = asking_person(bench.store, claimed)
    store = FencedStore(bench.store, lease, f"job {lease.job}: {claimed.label}", person)
    with Heartbeat(
        bench.store, lease, bench.lease_s, bench.ending, claimed.stop_requested
    ) as heart:
        heart.check()
        kind = KINDS[claimed.kind]
        arguments = kind.read(claimed.arguments)
        ending = kind.do(
            RunningJob(lease.job, store, bench.db, heart.step, bench.folders), arguments
        )
        heart.check()
        record = record_of(claimed, DONE)

        def end(session: Session) -> None:
            finish(session, lease, ending(), heart.progress)
            record(session)

        store.end(end)


def _ended(claimed: Claimed, end: Callable[[], None]) -> None:
    with suppress(LeaseLostError):
        end()
        after(claimed.kind, claimed.arguments, claimed.host)


def _handed_back(bench: WorkerContext, claimed: Claimed, why: str = "") -> None:
    """Where even that fails, the lease passes and another worker sees it."""
    with suppress(LeaseLostError, StoreError):
        give_back(bench.store, claimed.lease, why)


def _words(error: Exception) -> str:
    if is_for_the_user(error):
        return without_secrets(str(error))
    _log.error("a job failed", exc_info=error)
    words = without_secrets(f"{type(error).__name__}: {error}")
    return f"an error of pyroshock itself, {words}; the worker's log has its trace"


@dataclass
class Watch:
    """Remembers since when each running job has not moved."""

    clock: Callable[[], float] = time.monotonic
    _since: dict[Sighting, float] = field(default_factory=dict)
    _alive: set[int] = field(default_factory=set)

    def silent(self, seen: Iterable[Sighting]) -> list[Sighting]:
        """Of all jobs that run now, those whose lease has passed under this watch's eyes."""
        now, before = self.clock(), self._since
        earlier_jobs = {attempt.job for attempt in before}
        self._since = {attempt: before.get(attempt, now) for attempt in seen}
        running = {attempt.job for attempt in self._since}
        moved = {
            attempt.job
            for attempt in self._since
            if attempt.job in earlier_jobs and attempt not in before
        }
        self._alive = (self._alive & running) | moved
        return [attempt for attempt, since in self._since.items() if now - since >= attempt.lease_s]

    def forget(self) -> None:
        """Begin anew: while the store was out of reach nobody could be seen moving."""
        self._since.clear()

    @property
    def undecided(self) -> bool:
        """Whether a job runs that has neither moved yet nor been silent for long enough."""
        return any(attempt.job not in self._alive for attempt in self._since)


LEASE_S = 30.0
#: How often an idle worker asks, and how long it waits for a store that is away.
_POLL_S, _AWAY_S = 1.0, 5.0


class Worker:
    """Works on the jobs of a store, one at a time, and says to `tell` which it begins.

    `ask_now` wakes an idle one, `end` makes it give back what it holds.
    """

    def __init__(
        self,
        store: Store,
        db: str,
        *,
        lease_s: float = LEASE_S,
        folders: tuple[Path, ...] = (),
        host: str | None = None,
        name: str | None = None,
        tell: Callable[[str], None] = lambda _: None,
    ) -> None:
        host = host or this_host()
        self.hand = WorkerIdentity(
            name or f"{host}:{os.getpid()}:{uuid.uuid4().hex[:8]}", host, tuple(KINDS), lease_s
        )
        self.bench = WorkerContext(store, db, lease_s, folders)
        self.in_hand: Claimed | None = None
        self._watch, self._tell = Watch(), tell
        self._left: set[int] = set()
        self._woken = threading.Event()

    def run(self, *, once: bool = False) -> int:
        """Work until told to end; `once`: until nothing waits and no job is a dead worker's. How
        many it had.

        Raises `StoreRoleError` for a login that may not work; with `once` `StoreError` where the
        store is away.
        """
        had = 0
        with suppress(StoreError):
            tidy_up(self.bench.store)
        while not self.bench.ending.is_set():
            try:
                self.in_hand = self._next()
                if self.in_hand is None:
                    if once and not self._watch.undecided:
                        break
                    self._pause(min(_POLL_S, self.hand.lease_s / 6))
                    continue
                had += 1
                self._tell(f"job {self.in_hand.lease.job}: {self.in_hand.label}")
                if not attempt(self.bench, self.in_hand):
                    self._left.add(self.in_hand.lease.job)
            except (StoreError, SQLAlchemyError) as error:
                if once or isinstance(error, StoreRoleError):
                    raise
                _log.warning("%s; asking again in %.0f s", error, _AWAY_S)
                self._watch.forget()
                self._pause(_AWAY_S)
            finally:
                self.in_hand = None
        return had

    def ask_now(self) -> None:
        """There may be a job: look at once."""
        self._woken.set()

    def end(self) -> None:
        """Take no further job, and give back the one in hand at its next step."""
        self.bench.ending.set()
        self._woken.set()

    def let_go(self) -> None:
        """Give back what is in hand, from another thread: what its work still writes is not
        stored."""
        held = self.in_hand
        if held is not None:
            with suppress(LeaseLostError, StoreError):
                give_back(self.bench.store, held.lease)

    def _pause(self, seconds: float) -> None:
        self._woken.wait(seconds)
        self._woken.clear()

    def _next(self) -> Claimed | None:
        store = self.bench.store
        for silent in self._watch.silent(running(store, self.hand)):
            taken = self._after_death(silent)
            if taken is not None:
                _log.warning(
                    "job %d is taken over: its worker was silent for %g s",
                    silent.job,
                    silent.lease_s,
                )
                return taken
        return claim_waiting(store, self.hand, self._left)

    def _after_death(self, silent: Sighting) -> Claimed | None:
        if silent.deaths + 1 < MOST_DEATHS:
            return take_over(self.bench.store, self.hand, silent)
        if mark_dead(self.bench.store, silent):
            tidy_up(self.bench.store)
        return None
