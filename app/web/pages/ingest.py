"""Ingest by upload, or by the path of a folder on the server's machine."""

from __future__ import annotations

from typing import Annotated, Literal, cast

from fastapi import APIRouter, Form
from fastapi.concurrency import run_in_threadpool
from starlette.datastructures import UploadFile
from starlette.requests import Request
from starlette.responses import Response

from ....ingest.settings import ExtractionSettings
from ....schema.session import Store
from ...jobs.queue import JobView
from ...jobs.scratch import discard, make_scratch
from ..dependencies import Configured, OpenStore, Running
from ..folders import campaigns_below, confined
from ..ingesting import ingest_job
from ..jobs import Jobs
from ..rendering import page
from ..settings import Settings
from ..uploads import MOST_FILES, UploadError, unpacked
from .jobs import followed

router = APIRouter()
Way = Literal["walk", "mask"]


@router.get("/ingest")
def ingest(request: Request, settings: Configured) -> Response:
    return page(
        request,
        "ingest.html",
        folders=campaigns_below(settings.folders),
        roots=[str(root) for root in settings.folders],
        most_megabytes=settings.max_upload_bytes // 1_000_000,
        extraction=ExtractionSettings(),
    )


@router.post("/ingest/path")
def by_path(
    store: OpenStore,
    jobs: Running,
    settings: Configured,
    path: Annotated[str, Form(max_length=4000)],
    segmentation: Annotated[Literal["walk", "mask"], Form()] = "walk",
    threshold: Annotated[float, Form()] = 0.005,
    plan: Annotated[str, Form()] = "",
) -> Response:
    chosen = ExtractionSettings(segmentation=segmentation, threshold=threshold)
    return followed(ingest_job(jobs, store, confined(path, settings.folders), chosen, plan or None))


@router.post("/ingest/upload")
async def by_upload(request: Request, store: OpenStore, jobs: Running, settings: Configured) -> Response:
    return followed(await uploaded(request, store, jobs, settings))


async def uploaded(request: Request, store: Store, jobs: Jobs, settings: Settings) -> JobView:
    """The job that ingests what a form brings: `files`, and settings of the extraction. Raises `UploadError`."""
    async with request.form(max_files=MOST_FILES) as form:
        plan, segmentation, threshold = (form.get(name) for name in ("plan", "segmentation", "threshold"))
        chosen = ExtractionSettings(segmentation=_way(segmentation), threshold=_number(threshold, 0.005))
        sent = [
            (upload.filename or "", upload.file) for upload in form.getlist("files") if isinstance(upload, UploadFile)
        ]
        files = [file for file in sent if file[0]]
        scratch = make_scratch()
        try:
            folder = await run_in_threadpool(unpacked, files, scratch, settings.max_upload_bytes)
            return ingest_job(jobs, store, folder, chosen, str(plan) if plan else None, scratch)
        except BaseException:
            discard(scratch)
            raise


def _way(text: object) -> Way:
    """Checked by the settings themselves."""
    return cast(Way, text or "walk")


def _number(text: object, default: float) -> float:
    if text is None or text == "":
        return default
    try:
        return float(str(text))
    except ValueError as error:
        raise UploadError(f"threshold {text!r} is no number; expected a share of the peak such as 0.005") from error
