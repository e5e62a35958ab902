"""Long work: how far it is, and its stop."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Query

from ...web.dependencies import Key, Running

router = APIRouter(tags=["jobs"])


@router.get("/jobs")
def jobs(
    running: Running,
    before: Annotated[int | None, Query(ge=1, le=2**31 - 1)] = None,
    limit: Annotated[int, Query(ge=1, le=500)] = 200,
) -> list[dict[str, Any]]:
    """Jobs of the store, the newest first; earlier ones come `before` the last `id` of these.
    `result` is null here."""
    return [job.as_json() for job in running.listed(limit, before)]


@router.get("/jobs/{job}")
def job(job: Key, running: Running) -> dict[str, Any]:
    """One job: `state` is waiting, running, done, failed or stopped; `address` and `result` once it
    is done."""
    return running.get(job).as_json()


@router.post("/jobs/{job}/stop")
def stop(job: Key, running: Running) -> dict[str, Any]:
    """Ask a job to end at its next step; what it has stored is whole."""
    return running.stop(job).as_json()
