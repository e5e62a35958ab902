"""Long work that was asked for, as the Python library holds it: how far it is, and its result."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Generic, Protocol

from ..common.errors import (
    InvalidValueError,
    NotFoundError,
    PyroshockError,
    StorageError,
    argument_names,
    raises_library_errors,
)
from ..common.frames import step_bar
from ..operations.faults import read
from ..operations.laboratory import Laboratory
from ..operations.operation import Answer, Operation, Request, Result, same_fields

if TYPE_CHECKING:
    from ...schema.session import Store
    from ..jobs.queue import EndedJob, JobView

#: Seconds between two looks at a job: at first, and after a while.
_FIRST_LOOK_S, _LATER_LOOK_S = 0.05, 1.0
#: A server that is started anew within these seconds is waited for.
PATIENCE_S = 300.0
_FAULTS: dict[str, type[PyroshockError]] = {
    "not found": NotFoundError,
    "invalid": InvalidValueError,
    "storage": StorageError,
}


class JobSource(Protocol):
    """The store of a job, of this machine or behind a server. All of them raise `LookupError` for
    an unknown job, and `OSError` for a store that does not answer."""

    def job(self, number: int) -> JobView:
        """A job as its row says."""
        ...

    def ended(self, number: int) -> EndedJob:
        """What has come of a job."""
        ...

    def stop(self, number: int) -> None:
        """Ask a job to end."""
        ...

    def decoded(self, whole: Any) -> Any:
        """The result that a job has kept."""
        ...


class JobHandle(Generic[Answer]):
    """A job of the store. It goes on whether or not this handle, or this Python, is there."""

    def __init__(
        self, source: JobSource, number: int, title: str = "", steps: str = "steps"
    ) -> None:
        self._source, self.number = source, number
        self._title, self._steps = title, steps

    @property
    def state(self) -> str:
        """It is "waiting", "running", "done", "failed" or "stopped"."""
        return self.view.state

    @property
    @raises_library_errors
    def view(self) -> JobView:
        """The row of the job: `done` of `total` steps, `what` it does, its times, its worker."""
        return self._source.job(self.number)

    @raises_library_errors
    def cancel(self) -> None:
        """Ask the job to end: at once where it waits, at its next step where it runs. What it has
        stored is complete."""
        self._source.stop(self.number)

    @raises_library_errors
    def result(self, *, timeout_s: float | None = None, progress: bool = True) -> Answer:
        """Wait for the job, and give its result.

        Parameters:
            timeout_s: The time after which the wait ends, while the job goes on; by default none.
            progress: Whether a bar shows the progress.

        Raises:
            PyroshockError: As the same work on this machine, for a job that was stopped, and for
                one that has kept no result.
            StorageError: For a job that has not ended after `timeout_s`, and a server that does
                not answer for five minutes.
        """
        start_s = time.monotonic()
        try:
            title = self._title or f"job {self.number}"
            with step_bar(title.lower(), self._steps, progress) as step:
                self._wait(start_s, timeout_s, step)
        except KeyboardInterrupt as interruption:
            interruption.add_note(
                f"job {self.number} goes on; store.job({self.number}) waits for it again, and its "
                "cancel() ends it"
            )
            raise
        return self._outcome(self._source.ended(self.number))

    def _wait(
        self, start_s: float, timeout_s: float | None, step: Callable[[int, int, str], None]
    ) -> None:
        pause_s, silent_since_s = _FIRST_LOOK_S, None
        while True:
            try:
                job = self._source.job(self.number)
                silent_since_s = None
            except OSError as error:  # a server that is started anew goes on with its jobs
                now_s = time.monotonic()
                silent_since_s = silent_since_s or now_s
                if now_s - silent_since_s > PATIENCE_S:
                    raise StorageError(
                        f"{error}; job {self.number} may go on: store.job({self.number}) waits "
                        "for it again"
                    ) from error
            else:
                step(job.done, job.total, job.what)
                if job.ended:
                    return
            waited_s = time.monotonic() - start_s
            if timeout_s is not None and waited_s > timeout_s:
                raise StorageError(
                    f"job {self.number} has not ended after {timeout_s:g} s; it goes on: "
                    f"store.job({self.number}) waits for it again"
                )
            time.sleep(pause_s)
            pause_s = min(1.3 * pause_s, _LATER_LOOK_S)

    def _outcome(self, ended: EndedJob) -> Answer:
        if ended.state == "stopped":
            raise PyroshockError(f"job {self.number} was stopped before it had a result")
        if ended.state == "failed":
            raise _FAULTS.get(ended.fault, PyroshockError)(argument_names(ended.error or ""))
        if ended.whole is None:
            raise PyroshockError(
                f"job {self.number} has kept no result for this library: it is of an earlier "
                f"version, or too large; its page is /jobs/{self.number}"
            )
        result = self._source.decoded(ended.whole)
        if not isinstance(result, Result):
            raise StorageError(f"job {self.number} has a {type(result).__name__} for a result")
        return result  # type: ignore[return-value]  # of the operation that was asked for

    def __repr__(self) -> str:
        view = self.view
        return f"<job {self.number}, {self._title or view.label}: {view.state}>"


class LocalJobs:
    """The jobs of a store that this process has opened."""

    def __init__(self, store: Store, url: str) -> None:
        self._store, self._url = store, url

    def ask(self, operation: Operation[Any, Answer], request: Request) -> JobHandle[Answer]:
        """Put a request into the queue, which `pyroshock work` or a server works off."""
        from ..jobs.operation_kind import kind_of
        from ..jobs.queue import ask, this_host

        if operation.check is not None:
            operation.check(request, Laboratory(self._store, self._url))
        if operation.rehearsal is not None and getattr(request, "dry_run", False):
            operation = operation.rehearsal
            request = read(operation.request, same_fields(request, operation.request), "stored")
        host = this_host() if operation.on_this_machine else None
        title = operation.title(request)
        job = ask(self._store, kind_of(operation), title, request, host)
        return JobHandle(self, job.key, title, operation.steps)

    def job(self, number: int) -> JobView:
        """A job as its row says."""
        from ..jobs.queue import get_job

        return get_job(self._store, number)

    def ended(self, number: int) -> EndedJob:
        """What has come of a job."""
        from ..jobs.queue import ended_with

        return ended_with(self._store, number)

    def stop(self, number: int) -> None:
        """Ask a job to end."""
        from ..jobs.queue import stop_job

        stop_job(self._store, number)

    def decoded(self, whole: Any) -> Any:
        """The result that a job has kept."""
        from ..operations.result_codec import decode

        return decode(whole)
