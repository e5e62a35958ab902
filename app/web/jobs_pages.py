"""Long work: a list, and a page that follows one job."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Query
from starlette.requests import Request
from starlette.responses import RedirectResponse, Response

from ...schema.jobs import DONE
from ..jobs.queue import JobView
from .dependencies import Key, Running
from .rendering import page

router = APIRouter()
PAGE = 200
Before = Annotated[int | None, Query(ge=1, le=2**31 - 1)]


@router.get("/jobs")
def jobs(request: Request, running: Running, before: Before = None) -> Response:
    listed = running.listed(PAGE + 1, before)
    earlier = f"/jobs?before={listed[PAGE - 1].key}" if len(listed) > PAGE else ""
    return page(request, "jobs.html", jobs=listed[:PAGE], earlier=earlier)


@router.get("/jobs/{job}")
def job(request: Request, job: Key, running: Running) -> Response:
    job_row = running.get(job)
    return page(request, "job.html", job=job_row, ended=job_row.ended)


@router.post("/jobs/{job}/stop")
def stop(job: Key, running: Running) -> Response:
    return followed(running.stop(job))


def finished_result(running: Running, key: int, kind: str, noun: str) -> Any:
    """What a job of this kind has given. Raises `LookupError` for one of another kind, or that has not ended well."""
    job_row = running.get(key)
    if job_row.state != DONE or job_row.kind != kind:
        raise LookupError(f"job {key} is no finished {noun}; its page is /jobs/{key}")
    return job_row.result


def followed(job: JobView) -> Response:
    """On to the page of a job."""
    return RedirectResponse(f"/jobs/{job.key}", 303)
