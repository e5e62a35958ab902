"""Long work: a list, and a page that follows one job."""

from __future__ import annotations

from fastapi import APIRouter
from starlette.requests import Request
from starlette.responses import RedirectResponse, Response

from ..asking import Key, Running
from ..jobs import ENDED, Job
from ..rendering import page

router = APIRouter()


@router.get("/jobs")
def jobs(request: Request, running: Running) -> Response:
    return page(request, "jobs.html", jobs=running.listed())


@router.get("/jobs/{job}")
def job(request: Request, job: Key, running: Running) -> Response:
    found = running.get(job)
    return page(request, "job.html", job=found, ended=found.state in ENDED)


@router.post("/jobs/{job}/stop")
def stop(job: Key, running: Running) -> Response:
    return followed(running.stop(job))


def followed(job: Job) -> Response:
    """On to the page of a job."""
    return RedirectResponse(f"/jobs/{job.key}", 303)
