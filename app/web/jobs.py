"""Long work as the web application sees it: the store's queue, and a worker of its own that makes
the jobs progress."""

from __future__ import annotations

import logging
import threading
from typing import Any

from starlette.responses import RedirectResponse, Response

from ...schema.engine import StoreRoleError
from ...schema.jobs import DONE
from ...schema.person_roles import system_person
from ...schema.session import Store
from ..jobs.kind import Arguments, JobForm, Kind
from ..jobs.known_kinds import job_page
from ..jobs.operation_kind import kind_of
from ..jobs.queue import (
    AskingRecord,
    JobView,
    ask,
    ask_again,
    get_job,
    is_repeatable,
    job_form,
    this_host,
)
from ..jobs.worker import Worker
from ..operations.catalogue import OPERATIONS
from ..operations.catalogue import operation as operation_named
from ..operations.change_record import asking_record
from ..operations.faults import read
from ..operations.laboratory import Laboratory
from ..operations.operation import Operation, same_fields
from ..operations.operation import Request as OperationRequest

_log = logging.getLogger("pyroshock.web")


class Jobs:
    """The queue of a store; `worker` None: others do the work."""

    def __init__(self, store: Store, worker: Worker | None) -> None:
        self._store, self._worker = store, worker
        self._thread: threading.Thread | None = None

    def begin(self) -> None:
        """Let the worker work, on what an earlier server has left, too."""
        if self._worker is not None:
            self._thread = threading.Thread(
                target=_worked, args=(self._worker,), name="pyroshock worker", daemon=True
            )
            self._thread.start()

    def ask(
        self,
        store: Store,
        kind: Kind[Arguments],
        label: str,
        arguments: Arguments,
        host: str | None = None,
        record: AskingRecord = lambda _session, _job: None,
    ) -> JobView:
        """Queue a job, signed by the request's `store`."""
        job = ask(store, kind, label, arguments, host, record)
        if self._worker is not None:
            self._worker.ask_now()
        return job

    def get(self, key: int) -> JobView:
        """Raises `LookupError` for a number that no job has."""
        return get_job(self._store, key)

    def form_of(self, key: int) -> tuple[JobForm | None, bool]:
        """The form that asks for a job again, and whether it can be repeated as it was.

        (None, False) for a kind or arguments of another version of this software.
        """
        try:
            return job_form(self._store, key), is_repeatable(self._store, key)
        except (KeyError, ValueError):
            return None, False

    def again(self, store: Store, key: int) -> JobView:
        """Ask for an ended job once more, signed by the request's `store`. Raises `LookupError`,
        `ValueError`, and `RoleNeededError` where the person may not ask for it."""
        person = store.writer.person or system_person()

        def record_of(kind: str, request: Any) -> AskingRecord:
            if kind not in OPERATIONS:
                return lambda _session, _job: None
            declared = operation_named(kind)
            declared.check_role(person)
            return asking_record(declared, request, person)

        job = ask_again(store, key, record_of)
        if self._worker is not None:
            self._worker.ask_now()
        return job

    def close(self, patience_s: float = 4.0) -> None:
        """End the worker: what it has in hand goes back to the queue, at its next step or without
        one."""
        if self._worker is None or self._thread is None:
            return
        self._worker.end()
        self._thread.join(patience_s)
        self._worker.let_go()


def _worked(worker: Worker) -> None:
    try:
        worker.run()
    except StoreRoleError as error:  # a reader's server shows pages
        _log.warning("%s; this server does no jobs", error)


def finished_result(running: Jobs, key: int, kind: str, noun: str) -> Any:
    """What a job of this kind has given. Raises `LookupError` for one of another kind, or that has
    not ended well."""
    job_row = running.get(key)
    if job_row.state != DONE or job_row.kind != kind:
        raise LookupError(f"job {key} is no finished {noun}; its page is /jobs/{key}")
    return job_row.result


def followed(job: JobView) -> Response:
    """On to the page of a job."""
    page = job_page(job.kind) or "/jobs/{job}"
    return RedirectResponse(page.format(job=job.key), 303)


def ask_operation(
    operation: Operation[Any, Any],
    request: OperationRequest,
    laboratory: Laboratory,
    jobs: Jobs,
    host: str | None = None,
) -> JobView:
    """Queue a request, or its rehearsal. Raises what would only be refused after the work, and
    `RoleNeededError`."""
    operation.check_role(laboratory.person)
    if operation.check is not None:
        operation.check(request, laboratory)
    if operation.rehearsal is not None and getattr(request, "dry_run", False):
        operation = operation.rehearsal
        request = read(operation.request, same_fields(request, operation.request), "stored")
    if operation.on_this_machine:
        host = this_host()
    record = asking_record(operation, request, laboratory.person)
    title = operation.title(request)
    return jobs.ask(laboratory.store, kind_of(operation), title, request, host, record)
