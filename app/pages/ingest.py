"""Ingest: a folder that is dropped, chosen or named by its path is checked first, and stored from
the page that tells what would be in the store."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

from fastapi import APIRouter, Form
from sqlalchemy import select
from starlette.requests import Request
from starlette.responses import RedirectResponse, Response

from ...ingest.extraction.settings import ExtractionSettings
from ...schema.campaigns import Plan
from ...schema.jobs import DONE, Job
from ...schema.session import Store
from ..jobs.job_kinds.ingest import (
    CHECK,
    INGEST,
    IngestArguments,
    discard,
    take_checked,
)
from ..jobs.queue import JobView, UnknownJobError, this_host
from ..web.dependencies import Configured, Key, OpenStore, Running
from ..web.jobs import followed
from ..web.rendering import page
from ..web.uploads import (
    campaigns_below,
    confined,
    extraction_settings,
    ingest_job,
    known_plan,
    uploaded,
)

router = APIRouter()
#: Plans that the form offers.
_MOST_PLANS = 200


@router.get("/ingest")
def ingest(request: Request, store: OpenStore, settings: Configured) -> Response:
    with store.reading() as session:
        plans = session.scalars(select(Plan.name).order_by(Plan.id.desc()).limit(_MOST_PLANS)).all()
    return page(
        request,
        "ingest.html",
        folders=campaigns_below(settings.folders),
        roots=[str(root) for root in settings.folders],
        most_bytes=settings.max_upload_bytes,
        extraction=ExtractionSettings(),
        plans=plans,
    )


@router.post("/ingest/path")
def by_path(
    store: OpenStore,
    jobs: Running,
    settings: Configured,
    path: Annotated[str, Form(max_length=4000)],
    segmentation: Annotated[str, Form()] = "walk",
    threshold: Annotated[str, Form()] = "",
    plan: Annotated[str, Form()] = "",
    dry_run: Annotated[bool, Form()] = False,
) -> Response:
    """Check a folder of the server's machine, or store it."""
    chosen = extraction_settings(segmentation, threshold)
    folder = confined(path, settings.folders)
    return _shown(ingest_job(jobs, store, folder, chosen, known_plan(store, plan), dry_run=dry_run))


@router.post("/ingest/upload")
async def by_upload(
    request: Request, store: OpenStore, jobs: Running, settings: Configured
) -> Response:
    """Check uploaded files, or store them."""
    return _shown(await uploaded(request, store, jobs, settings))


def _shown(job: JobView) -> Response:
    return (
        RedirectResponse(f"/ingest/checks/{job.key}", 303)
        if job.kind == CHECK.name
        else followed(job)
    )


@router.get("/ingest/checks/{job}")
def checked(request: Request, job: Key, store: OpenStore, jobs: Running) -> Response:
    """A dry run: how far it is, then what would be stored and what is wrong."""
    job_row, arguments = jobs.get(job), _arguments(store, job)
    result: dict[str, Any] | None = job_row.result if job_row.state == DONE else None
    report = (result or {}).get("report") or {}
    return page(
        request,
        "check.html",
        job=job_row,
        ended=job_row.ended,
        folder=Path(arguments.folder).name,
        place=arguments.folder if arguments.scratch is None else "",
        result=result,
        kept=arguments.scratch is None or Path(arguments.scratch).is_dir(),
        faults=faults_by_file(result["faults"]) if result else {},
        findings=findings_by_check(report.get("findings", ())),
        set_aside=report.get("set_aside", []),
    )


@router.post("/ingest/checks/{job}/store")
def store_checked(job: Key, store: OpenStore, jobs: Running, settings: Configured) -> Response:
    """Store what was checked, with the same settings."""
    arguments, job_row = _arguments(store, job), jobs.get(job)
    if job_row.state != DONE or (job_row.result or {}).get("faults"):
        raise ValueError("only a folder that was checked without a fault can be stored")
    if arguments.scratch is None:
        confined(arguments.folder, settings.folders)
    taken = take_checked(arguments)
    return followed(
        jobs.ask(store, INGEST, f"Ingest of {Path(arguments.folder).name}", taken, host=this_host())
    )


@router.post("/ingest/checks/{job}/discard")
def discard_checked(job: Key, store: OpenStore) -> Response:
    """Remove an upload that nobody wants to store; a folder that was named by its path stays as it
    is."""
    arguments = _arguments(store, job)
    if arguments.scratch is not None:
        discard(Path(arguments.scratch))
    return RedirectResponse("/ingest", 303)


def _arguments(store: Store, key: int) -> IngestArguments:
    """What a dry run was asked for. Raises `UnknownJobError` for a job of another kind."""
    query = select(Job.arguments).where(Job.id == key, Job.kind == CHECK.name)
    stored = store.read(lambda session: session.scalar(query))
    if stored is None:
        raise UnknownJobError(f"job {key} is no check of a folder; its page is /jobs/{key}")
    return CHECK.read(stored)


def faults_by_file(faults: Sequence[str]) -> dict[str, list[str]]:
    """Faults by the file that each begins with."""
    grouped: dict[str, list[str]] = {}
    for fault in faults:
        file, colon, words = fault.partition(": ")
        grouped.setdefault(file if colon else "the folder", []).append(words if colon else fault)
    return grouped


def findings_by_check(findings: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """A row for each check and severity, the worst first: how often, in which recordings, and its
    first message."""
    order = {"reject": 0, "warning": 1, "note": 2}
    rows: dict[tuple[str, str], dict[str, Any]] = {}
    for finding in findings:
        key = (finding["severity"], finding["check"])
        new = {
            "severity": key[0],
            "check": key[1],
            "findings": 0,
            "recordings": [],
            "message": finding["message"],
        }
        row = rows.setdefault(key, new)
        row["findings"] += 1
        if finding["recording"] and finding["recording"] not in row["recordings"]:
            row["recordings"].append(finding["recording"])
    listed = sorted(rows.values(), key=lambda row: (order[row["severity"]], -row["findings"]))
    return [{**row, "recordings": _some(row["recordings"])} for row in listed]


def _some(names: Sequence[str]) -> str:
    more = f" and {len(names) - 3} more" if len(names) > 3 else ""
    return ", ".join(names[:3]) + more or "the campaign"
