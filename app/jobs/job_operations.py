"""Long work: which jobs there are, one of them shown, stopped or deleted."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field

from ...schema.person_roles import OPERATOR
from ..operations.fields import Presentation, request_field, row_limit
from ..operations.laboratory import Laboratory
from ..operations.operation import FormPage, Operation, Outcome, Progress, Request, Result, Rows

if TYPE_CHECKING:
    from .queue import JobView

#: So many jobs are listed where nobody says how many, for people and over a network; a network
#: gets no more than the last number.
_USUAL, _USUAL_PAGE, _LONGEST_PAGE = 20, 200, 500
_Number = Annotated[int, Field(ge=1, le=2**31 - 1)]


class JobListing(Request):
    """Which jobs are listed."""

    limit: row_limit(_USUAL_PAGE, _LONGEST_PAGE) = request_field(  # type: ignore[valid-type]
        None,
        validate_default=True,
        help="List at most this number of jobs, the newest first. [default: 20, over a network "
        "200]",
        presentation=Presentation(option="last"),
    )
    before: _Number | None = request_field(
        None, help="List the jobs older than the one with this number."
    )


class JobRows(Rows):
    """Jobs, the newest first, without their results."""

    def shortened(self, row: Mapping[str, Any]) -> dict[str, Any]:
        """How far a job is, and what it last said."""
        return {
            "id": row["id"],
            "state": row["state"],
            "what": row["label"],
            "progress": f"{row['done']} of {row['total']}" if row["total"] else None,
            "worker": row["worker"],
            "attempt": row["attempt"] or None,
            "told": " ".join((row["error"] or row["words"] or row["what"] or "").split()) or None,
        }


def _list(request: JobListing, laboratory: Laboratory, _: Progress) -> JobRows:
    from .queue import list_jobs

    jobs = list_jobs(laboratory.store, request.limit or _USUAL, request.before)
    return JobRows([job.as_json() for job in jobs], "no jobs")


JOB_LIST: Operation[JobListing, JobRows] = Operation(
    name="job-list",
    request=JobListing,
    run=_list,
    help="""List the long work: which jobs wait, which run and where, and with which result they
ended.

Earlier jobs come `before` the last `id` of a list. `result` is null here.""",
    example="pyroshock jobs list --last 50",
    command=("jobs", "list"),
    route=("GET", "/jobs"),
    listing=True,
    absent={"form": "It changes nothing; the page /jobs shows the list."},
)


class NamedJob(Request):
    """One job of the store."""

    job: _Number = request_field(
        help="Give the number of the job.", presentation=Presentation(positional=True)
    )


@dataclass(frozen=True)
class StoredJob(Result):
    """A job as its row said when it was read."""

    job: JobView

    def text(self) -> str:
        """A line for each of its facts."""
        facts = self.to_json().items()
        return "\n".join(f"{key:24} {'-' if value is None else value}" for key, value in facts)

    def to_json(self) -> dict[str, Any]:
        """`state` is waiting, running, done, failed or stopped; `address` and `result` once it is
        done."""
        return self.job.as_json()


def _show(request: NamedJob, laboratory: Laboratory, _: Progress) -> StoredJob:
    from .queue import get_job

    return StoredJob(get_job(laboratory.store, request.job))


JOB_SHOW: Operation[NamedJob, StoredJob] = Operation(
    name="job-show",
    request=NamedJob,
    run=_show,
    help="Show the job with number JOB: its state, its times, and its result or the error that "
    "ended it.",
    example="pyroshock jobs show 1",
    command=("jobs", "show"),
    route=("GET", "/jobs/{job}"),
    absent={"form": "It changes nothing; the page of the job shows it."},
)


def _stop(request: NamedJob, laboratory: Laboratory, _: Progress) -> Outcome:
    from .claims import stop
    from .known_kinds import job_page

    job = stop(laboratory.store, request.job)
    line = f"job {job.key}, {job.label}: {job.state if job.ended else 'asked to stop'}"
    page = (job_page(job.kind) or "/jobs/{job}").format(job=job.key)
    return Outcome((line,), job.as_json(), page)


JOB_STOP: Operation[NamedJob, Outcome] = Operation(
    name="job-stop",
    request=NamedJob,
    run=_stop,
    help="Ask JOB to end: at once if it waits, at its next step if it runs. What it has stored is "
    "complete.",
    example="pyroshock jobs stop 1",
    command=("jobs", "stop"),
    route=("POST", "/jobs/{job}/stop"),
    form=FormPage("/jobs/{job}", "job-stop", "/jobs/{job}/stop"),
)


def _ended(request: NamedJob, laboratory: Laboratory) -> str:
    from .queue import ended_job

    return f"job {request.job}, {ended_job(laboratory.store, request.job).label}"


def _delete(request: NamedJob, laboratory: Laboratory, _: Progress) -> Outcome:
    from .queue import delete_job, ended_job

    label = ended_job(laboratory.store, request.job).label
    delete_job(laboratory.store, request.job)
    line = f"job {request.job}, {label}: deleted"
    return Outcome((line,), {"job": request.job, "label": label}, "/jobs")


JOB_DELETE: Operation[NamedJob, Outcome] = Operation(
    name="job-delete",
    role=OPERATOR,
    request=NamedJob,
    run=_delete,
    help="Delete the job with number JOB from the list. What it has stored stays. A job that has "
    "not ended is refused.",
    example="pyroshock jobs stop 1\npyroshock jobs delete 1 --yes",
    command=("jobs", "delete"),
    route=("POST", "/jobs/{job}/delete"),
    deletes=_ended,
    form=FormPage("/jobs/{job}", "job-delete", "/jobs/{job}/delete"),
)
