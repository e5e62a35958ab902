"""The queue as those see it who ask: a job is asked for, looked up, listed, stopped."""

from __future__ import annotations

import os
import socket
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

from sqlalchemy import delete, select, update
from sqlalchemy.orm import Session, undefer

from ...schema.base import to_plain
from ...schema.job_results import data_of, stored_fault, stored_whole
from ...schema.jobs import ENDED, RUNNING, STOPPED, WAITING, Job
from ...schema.provenance import Provenance
from ...schema.session import Store
from ..common.number_format import finite
from ..operations.upload_folders import stored_scratch
from .kind import Arguments, JobForm, Kind
from .known_kinds import KINDS

#: The name of this machine where the system's is of no use: a container's changes with every start.
HOST_VARIABLE = "PYROSHOCK_HOST"


class UnknownJobError(LookupError):
    """The store has no job of this number."""


@dataclass(frozen=True)
class JobView:
    """A job as its row said when it was read. `result` is read with a single job only."""

    key: int
    kind: str
    label: str
    state: str
    done: int
    total: int
    what: str
    error: str | None
    address: str | None
    words: str | None
    result: Any
    host: str | None
    attempt: int
    worker: str | None
    stop_requested: bool
    asked_at: datetime
    started_at: datetime | None
    ended_at: datetime | None

    @property
    def ended(self) -> bool:
        return self.state in ENDED

    def as_json(self) -> dict[str, Any]:
        """As `/api/jobs` tells it; times are to the second."""
        fields = {
            name: value
            for name, value in vars(self).items()
            if name not in ("key", "stop_requested")
        }
        times = {name: _second(fields[name]) for name in ("asked_at", "started_at", "ended_at")}
        return {"id": self.key, **fields, **times, "result": finite(self.result)}


def _second(time: datetime | None) -> str | None:
    return None if time is None else time.isoformat(timespec="seconds")


def this_host() -> str:
    """How jobs call this machine that only it can do."""
    return os.environ.get(HOST_VARIABLE) or socket.gethostname()


#: Writes what else belongs to a new job, of the number that it has, in its transaction.
AskingRecord = Callable[[Session, int], None]


def _nothing_else(_session: Session, _job: int) -> None:
    pass


def ask(
    store: Store,
    kind: Kind[Arguments],
    label: str,
    arguments: Arguments,
    host: str | None = None,
    record: AskingRecord = _nothing_else,
) -> JobView:
    """Put a job at the end of the queue; `host` where only one machine has what it needs. The job
    keeps for whom the store's writer asks."""
    person = store.writer.person

    def work(session: Session) -> int:
        job = Job(
            asked_by=None if person is None else person.name,
            asked_by_kind=None if person is None else person.kind,
            kind=kind.name,
            label=to_plain(label),
            arguments=kind.plain(arguments),
            host=host,
            asked_at=datetime.now(UTC),
        )
        session.add(job)
        session.flush()
        record(session, job.id)
        return job.id

    return get_job(store, store.write(work))


def get_job(store: Store, key: int) -> JobView:
    """One job with its result. Raises `UnknownJobError`."""
    with store.reading() as session:
        job = session.get(Job, key, options=[undefer(Job.result)])
        if job is None:
            raise UnknownJobError(f"no job {key} in the store; pyroshock jobs lists them")
        return _view(job, data_of(job.result))


@dataclass(frozen=True)
class EndedJob:
    """What has come of a job for a client: its whole result, or which kind of error ended it."""

    kind: str
    state: str
    error: str | None
    fault: str
    whole: Any


def ended_with(store: Store, key: int) -> EndedJob:
    """What has come of a job, None as the whole result of one that has none. Raises
    `UnknownJobError`."""
    with store.reading() as session:
        job = session.get(Job, key, options=[undefer(Job.result)])
        if job is None:
            raise UnknownJobError(f"no job {key} in the store; pyroshock jobs lists them")
        whole, fault = stored_whole(job.result), stored_fault(job.result)
        return EndedJob(job.kind, job.state, job.error, fault, whole)


def list_jobs(
    store: Store, limit: int = 200, before: int | None = None, state: str | None = None
) -> list[JobView]:
    """The newest first, without their results: at most `limit`, of those older than number
    `before`, in one `state`."""
    query = select(Job).order_by(Job.id.desc()).limit(limit)
    if state is not None:
        query = query.where(Job.state == state)
    if before is not None:
        query = query.where(Job.id < before)
    with store.reading() as session:
        return [_view(job, None) for job in session.scalars(query)]


def users_of(store: Store, keys: Sequence[int]) -> dict[int, str]:
    """Who asked for jobs: the login of the process that wrote each into the queue."""
    query = select(Job.id, Provenance.user).join(Provenance, Job.written_by_id == Provenance.id)
    with store.reading() as session:
        return {row.id: row.user for row in session.execute(query.where(Job.id.in_(keys)))}


def job_form(store: Store, key: int) -> JobForm | None:
    """The form that asks for a job again, with its values; None where there is none. Raises
    `UnknownJobError`."""
    kind, arguments = _asked(store, key)[:2]
    return kind.form(kind.read(arguments))


def is_repeatable(store: Store, key: int) -> bool:
    """Whether a job can be asked for again as it was: the files of an upload are gone once their
    job is over."""
    return stored_scratch(_asked(store, key)[1]) is None


def ask_again(
    store: Store, key: int, record_of: Callable[[str, Any], AskingRecord] | None = None
) -> JobView:
    """Put a job that has ended at the end of the queue again; `record_of` gives the record of a
    kind of job and its arguments. Raises `UnknownJobError`, `ValueError`."""
    kind, arguments, label, host = _asked(store, key)
    if not get_job(store, key).ended:
        raise ValueError(f"job {key} has not ended yet; stop it first")
    if stored_scratch(arguments) is not None:
        raise ValueError("the files that were uploaded for this job are gone; send them again")
    request = kind.read(arguments)
    record = _nothing_else if record_of is None else record_of(kind.name, request)
    return ask(store, kind, label, request, host, record)


def _asked(store: Store, key: int) -> tuple[Kind[Any], dict[str, Any], str, str | None]:
    """Kind, arguments, label and host of a job."""
    with store.reading() as session:
        job = session.get(Job, key, options=[undefer(Job.arguments)])
        if job is None:
            raise UnknownJobError(f"no job {key} in the store; pyroshock jobs lists them")
        return KINDS[job.kind], dict(job.arguments), job.label, job.host


def stop_job(store: Store, key: int) -> JobView:
    """Ask a job to end: at once where it waits, at its next step where it runs. Raises
    `UnknownJobError`."""
    get_job(store, key)
    store.write(lambda session: _stop(session, key), idempotent=True)
    return get_job(store, key)


class JobNotEndedError(ValueError):
    """The job waits or runs, and cannot be deleted."""


def ended_job(store: Store, key: int) -> JobView:
    """A job that may be deleted. Raises `UnknownJobError`, and `JobNotEndedError` for one that
    waits or runs."""
    job = get_job(store, key)
    if not job.ended:
        raise JobNotEndedError(
            f"job {key} cannot be deleted: it is {job.state}; stop it first: "
            f"pyroshock jobs stop {key}"
        )
    return job


def delete_job(store: Store, key: int) -> None:
    """Delete the row of a job that has ended. Raises as `ended_job`."""
    ended_job(store, key)
    store.write(
        lambda session: session.execute(delete(Job).where(Job.id == key, Job.state.in_(ENDED)))
    )


def _stop(session: Session, key: int) -> None:
    at_once = {"state": STOPPED, "stop_requested": True, "ended_at": datetime.now(UTC)}
    session.execute(update(Job).where(Job.id == key, Job.state == WAITING).values(at_once))
    session.execute(
        update(Job).where(Job.id == key, Job.state == RUNNING).values(stop_requested=True)
    )


def _view(job: Job, result: Any) -> JobView:
    same = [name for name in JobView.__dataclass_fields__ if name not in ("key", "result")]
    return JobView(key=job.id, result=result, **{name: getattr(job, name) for name in same})
