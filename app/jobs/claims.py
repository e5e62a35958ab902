"""How a worker comes by a job, one that waits or one whose worker has fallen silent, and what is
removed once a job is over, by whoever ends it: an upload's folder, on the machine that it lies
on."""

from __future__ import annotations

import logging
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

from sqlalchemy import ColumnElement, or_, select, update
from sqlalchemy.orm import Session

from ...schema.jobs import ENDED, FAILED, RUNNING, WAITING, Job
from ...schema.session import Store
from .known_kinds import KINDS
from .lease import Lease
from .queue import JobView, stop_job, this_host

#: A job that so many workers have died of is not given to another one.
MOST_DEATHS = 3


@dataclass(frozen=True)
class WorkerIdentity:
    """Who takes jobs: its name, its machine, the kinds that it knows, and for how long it may be
    silent."""

    name: str
    host: str
    kinds: tuple[str, ...]
    lease_s: float

    def may(self) -> tuple[ColumnElement[bool], ...]:
        """The condition of the jobs that it can do."""
        return (Job.kind.in_(self.kinds), or_(Job.host.is_(None), Job.host == self.host))


@dataclass(frozen=True)
class Claimed:
    """A job that is this worker's, as it was asked for."""

    lease: Lease
    kind: str
    label: str
    arguments: dict[str, Any]
    host: str | None
    stop_requested: bool
    #: The name of the person who asked, and how it is known; None of a job of an earlier version.
    asked_by: str | None = None
    asked_by_kind: str | None = None


@dataclass(frozen=True)
class Sighting:
    """A running job as it was seen: the same sighting again means that its worker has not moved in
    between."""

    job: int
    attempt: int
    beat: int
    deaths: int
    lease_s: float


def running(store: Store, hand: WorkerIdentity) -> list[Sighting]:
    """All jobs under way that this worker could do."""
    columns = (Job.id, Job.attempt, Job.beat, Job.deaths, Job.lease_s)
    query = select(*columns).where(Job.state == RUNNING, *hand.may()).order_by(Job.id)
    rows = store.read(lambda session: session.execute(query).all())
    # a running job has a lease: a rule of the table
    return [
        Sighting(job, attempt, beat, deaths, lease_s or 0.0)
        for job, attempt, beat, deaths, lease_s in rows
    ]


def claim_waiting(
    store: Store, hand: WorkerIdentity, skipped: Collection[int] = ()
) -> Claimed | None:
    """The job that has waited longest, but for those `skipped` to others; None where there is
    none."""
    query = (
        select(Job.id)
        .where(Job.state == WAITING, *hand.may(), Job.id.not_in(skipped))
        .order_by(Job.id)
        .limit(1)
    )
    if store.read(lambda session: session.scalar(query)) is None:
        return None  # asked first: on SQLite a claim takes the lock of all writers
    return store.write(lambda session: _take(session, hand, query, worker_died=False))


def take_over(store: Store, hand: WorkerIdentity, silent: Sighting) -> Claimed | None:
    """A silent worker's job; None where it moved after all, or somebody else was faster."""
    query = select(Job.id).where(*_still(silent))
    return store.write(lambda session: _take(session, hand, query, worker_died=True))


def mark_dead(store: Store, silent: Sighting) -> bool:
    """End a job that has cost as many workers as any may; whether it was still silent."""
    error = (
        f"{silent.deaths + 1} workers in turn were killed at it or fell silent (memory, or a "
        "library that crashes, perhaps); it is not begun again: try it with less data"
    )
    ended = {
        "state": FAILED,
        "error": error,
        "ended_at": datetime.now(UTC),
        "deaths": Job.deaths + 1,
    }

    def work(session: Session) -> bool:
        if session.scalar(_free(select(Job.id).where(*_still(silent)))) is None:
            return False
        session.execute(update(Job).where(*_still(silent)).values(ended))
        return True

    return store.write(work)


def _still(silent: Sighting) -> tuple[ColumnElement[bool], ...]:
    seen = (Job.attempt == silent.attempt, Job.beat == silent.beat, Job.state == RUNNING)
    return (Job.id == silent.job, *seen)


def _free(query: Any) -> Any:
    """Rows that no transaction holds: a row that one does is being claimed, or its worker is
    writing, so it lives."""
    return query.with_for_update(skip_locked=True)


def _take(session: Session, hand: WorkerIdentity, query: Any, worker_died: bool) -> Claimed | None:
    key = session.scalar(_free(query))
    if key is None:
        return None
    taken = {
        "state": RUNNING,
        "attempt": Job.attempt + 1,
        "deaths": Job.deaths + int(worker_died),
        "worker": hand.name,
        "lease_s": hand.lease_s,
        "beat": Job.beat + 1,
        "started_at": datetime.now(UTC),
        **{"done": 0, "total": 0, "what": ""},
    }
    session.execute(
        update(Job).where(Job.id == key).values(taken).execution_options(synchronize_session=False)
    )
    job = session.get_one(Job, key)
    return Claimed(
        Lease(key, job.attempt),
        *(job.kind, job.label, job.arguments, job.host, job.stop_requested),
        *(job.asked_by, job.asked_by_kind),
    )


_log = logging.getLogger("pyroshock.jobs")
#: Of jobs that ended while nobody could tidy up, so many are looked at.
_MOST = 200


def after(kind: str, arguments: Mapping[str, Any], host: str | None) -> None:
    """Tidy up after a job that is over; on another machine than the one that it was bound to
    nothing is done."""
    if host != this_host() or kind not in KINDS:
        return
    try:
        KINDS[kind].after(KINDS[kind].read(arguments))
    except (ValueError, OSError) as error:
        _log.warning("not tidied up after a job of kind %s: %s", kind, error)


def tidy_up(store: Store) -> None:
    """What jobs have left that were bound to this machine and ended elsewhere, or as their worker
    was killed."""
    columns = (Job.kind, Job.arguments, Job.host)
    ended = (
        select(*columns)
        .where(Job.state.in_(ENDED), Job.host == this_host())
        .order_by(Job.id.desc())
        .limit(_MOST)
    )
    for kind, arguments, host in store.read(lambda session: session.execute(ended).all()):
        after(kind, arguments, host)


def stop(store: Store, key: int) -> JobView:
    """As `queue.stop_job`, and nothing is left of a job that had not begun."""
    stopped_job = stop_job(store, key)
    if stopped_job.ended:
        with store.reading() as session:
            job = session.get_one(Job, key)
            kind, arguments, host = job.kind, job.arguments, job.host
        after(kind, arguments, host)
    return stopped_job
