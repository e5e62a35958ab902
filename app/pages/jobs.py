"""Long work: a list, and a page that follows one job."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Depends, Query
from starlette.requests import Request
from starlette.responses import Response

from ...schema.jobs import FAILED, STATES, STOPPED
from ...schema.person_roles import OPERATOR
from ..jobs.kind import JobForm
from ..jobs.queue import JobView, list_jobs, users_of
from ..operations.machine_paths import shown_path
from ..web.dependencies import Configured, Key, OpenStore, Running
from ..web.job_words import (
    duration_words,
    elapsed_s,
    kind_words,
    next_step_words,
    result_words,
    time_words,
)
from ..web.jobs import followed
from ..web.rendering import page, query
from ..web.role_needs import NeedsRole

router = APIRouter()
_ASKS_AGAIN = NeedsRole(OPERATOR, "asking for a job again")
PAGE = 200
Before = Annotated[int | None, Query(ge=1, le=2**31 - 1)]


@router.get("/jobs")
def jobs(request: Request, store: OpenStore, before: Before = None, state: str = "") -> Response:
    unknown = state not in ("", *STATES)
    listed = [] if unknown else list_jobs(store, PAGE + 1, before, state or None)
    users = users_of(store, [job.key for job in listed])
    rows = [
        (job, kind_words(job.kind), _duration(job), users.get(job.key, "")) for job in listed[:PAGE]
    ]
    earlier = (
        f"/jobs{query({'before': listed[PAGE - 1].key, 'state': state})}"
        if len(listed) > PAGE
        else ""
    )
    return page(
        request,
        "jobs.html",
        422 if unknown else 200,
        rows=rows,
        states=STATES,
        state=state,
        unknown=unknown,
        earlier=earlier,
    )


def _duration(job: JobView) -> str:
    elapsed = elapsed_s(job)
    return "–" if elapsed is None else duration_words(elapsed)


@router.get("/jobs/{job}")
def job(
    request: Request, job: Key, store: OpenStore, running: Running, settings: Configured
) -> Response:
    job_row = running.get(job)
    unfinished = job_row.state in (FAILED, STOPPED)
    form, repeatable = running.form_of(job) if unfinished else (None, False)
    return page(
        request,
        "job.html",
        job=job_row,
        kind=kind_words(job_row.kind),
        times=time_words(job_row),
        result=result_words(job_row.address),
        next_step=next_step_words(job_row, repeatable),
        form=_form_address(form, job),
        repeatable=repeatable,
        user=users_of(store, [job]).get(job, ""),
        ended=job_row.ended,
        folders=settings.folders,
    )


def _form_address(form: JobForm | None, key: int) -> str:
    """The page of a form, which fetches the values of job `key` where its address does not hold
    them."""
    if form is None or not form.fields:
        return "" if form is None else form.address
    address, mark, place = form.address.partition("#")
    return f"{address}{'&' if '?' in address else '?'}again={key}{mark}{place}"


@router.get("/jobs/{job}/form")
def form_values(job: Key, running: Running, settings: Configured) -> dict[str, Any]:
    """The form of a page that asks for this job again, and the values of its fields."""
    running.get(job)
    form, _ = running.form_of(job)
    if form is None:
        raise LookupError(f"no page has a form that asks for job {job} again")
    fields = dict(form.fields)
    if isinstance(path := fields.get("path"), str):
        fields["path"] = shown_path(path, settings.folders)
    return {"form": form.form, "fields": fields}


@router.post("/jobs/{job}/again", dependencies=[Depends(_ASKS_AGAIN)])
def again(job: Key, store: OpenStore, running: Running) -> Response:
    """Ask for a job that failed or was stopped once more, with the same values."""
    return followed(running.again(store, job))
