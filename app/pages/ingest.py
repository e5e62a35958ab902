"""Ingest: a folder that is dropped, chosen or named by its path is checked first, and stored from
the page that tells what would be in the store."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from fastapi import APIRouter, Depends
from sqlalchemy import select
from starlette.requests import Request
from starlette.responses import RedirectResponse, Response

from ...schema.campaigns import Plan
from ...schema.jobs import DONE, Job
from ...schema.session import Store
from ..jobs.queue import UnknownJobError
from ..operations.faults import read
from ..operations.form import controls
from ..operations.ingest.folder import CHECK, INGEST
from ..operations.ingest.request import FolderIngest, FolderReading
from ..operations.laboratory import Laboratory
from ..operations.machine_paths import (
    MachinePath,
    campaigns_below,
    confined,
    scratches_of,
    shown_path,
)
from ..operations.operation import same_fields
from ..operations.upload_folders import discard, take_checked
from ..web.dependencies import Configured, InLaboratory, Key, OpenStore, Running
from ..web.jobs import ask_operation, followed
from ..web.page_words import in_page_words
from ..web.rendering import page
from ..web.role_needs import role_of
from ..web.uploads import asked_of_upload

router = APIRouter()
#: The path has a place of its own in the form, and its buttons say whether it is a dry run.
_CONTROLS = INGEST.request.model_fields.keys() - {"path", "dry_run"}
#: Plans that the form offers.
_MOST_PLANS = 200


@router.get("/ingest")
def ingest(request: Request, store: OpenStore, settings: Configured, plan: str = "") -> Response:
    with store.reading() as session:
        plans = session.scalars(select(Plan.name).order_by(Plan.id.desc()).limit(_MOST_PLANS)).all()
    return page(
        request,
        "ingest.html",
        folders=[shown_path(path, settings.folders) for path in campaigns_below(settings.folders)],
        roots=[root.resolve().name for root in settings.folders],
        most_bytes=settings.max_upload_bytes,
        controls=controls(
            INGEST, {"plan": plan} if plan else {}, names=_CONTROLS, suggestions={"plan": plans}
        ),
        plan=plan,
    )


@router.post("/ingest/upload", dependencies=[Depends(role_of(INGEST))])
async def by_upload(
    request: Request, laboratory: InLaboratory, jobs: Running, settings: Configured
) -> Response:
    """Check uploaded files, or store them."""
    return followed(await asked_of_upload(request, laboratory, jobs, settings))


@router.get("/ingest/checks/{job}")
def checked(
    request: Request, job: Key, store: OpenStore, jobs: Running, settings: Configured
) -> Response:
    """A dry run: how far it is, then what would be stored and what is wrong."""
    job_row, checked_path = jobs.get(job), _asked(store, job).path
    scratch = checked_path.scratch
    result: dict[str, Any] | None = job_row.result if job_row.state == DONE else None
    report = (result or {}).get("report") or {}
    return page(
        request,
        "check.html",
        job=job_row,
        ended=job_row.ended,
        folder=checked_path.path.name,
        place=checked_path.path.name if scratch is None else "",
        result=result,
        kept=scratch is None or scratch.is_dir(),
        faults=faults_by_file(
            [in_page_words(fault, settings.folders) for fault in result["faults"]]
        )
        if result
        else {},
        findings=findings_by_check(report.get("findings", ())),
        set_aside=report.get("set_aside", []),
        form_job=checked_path.form,
        written=sorted((result or {}).get("written") or {}),
    )


@router.post("/ingest/checks/{job}/store", dependencies=[Depends(role_of(INGEST))])
def store_checked(job: Key, store: OpenStore, jobs: Running, settings: Configured) -> Response:
    """Store what was checked, with the same settings."""
    checked_request, job_row = _asked(store, job), jobs.get(job)
    if job_row.state != DONE or (job_row.result or {}).get("faults"):
        raise ValueError("only a folder that was checked without a fault can be stored")
    folder, scratch = checked_request.path.path, checked_request.path.scratch
    if scratch is None:
        taken = MachinePath(path=confined(str(folder), settings.folders))
    else:
        kept = take_checked(scratch)
        taken = MachinePath(path=kept / folder.relative_to(scratch), scratch=kept)
    values = {**same_fields(checked_request, FolderIngest), "path": taken}
    laboratory = Laboratory(store, settings.db, folders=settings.folders)
    return followed(ask_operation(INGEST, read(FolderIngest, values, "stored"), laboratory, jobs))


@router.post("/ingest/checks/{job}/discard", dependencies=[Depends(role_of(INGEST))])
def discard_checked(job: Key, store: OpenStore) -> Response:
    """Remove an upload that nobody wants to store; a folder that was named by its path stays as it
    is."""
    for scratch in scratches_of(_asked(store, job)):
        discard(scratch)
    return RedirectResponse("/ingest", 303)


def _asked(store: Store, key: int) -> FolderReading:
    """What a dry run was asked for. Raises `UnknownJobError` for a job of another kind."""
    query = select(Job.arguments).where(Job.id == key, Job.kind == CHECK.name)
    stored = store.read(lambda session: session.scalar(query))
    if stored is None:
        raise UnknownJobError(f"job {key} is no check of a folder; its page is /jobs/{key}")
    return read(FolderReading, stored, "stored")


def faults_by_file(faults: Sequence[str]) -> dict[str, list[str]]:
    """Faults by the file that each begins with."""
    grouped: dict[str, list[str]] = {}
    for fault in faults:
        file, colon, words = fault.partition(": ")
        grouped.setdefault((colon and file) or "the folder", []).append(words if colon else fault)
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
            "message": in_page_words(finding["message"]),
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
