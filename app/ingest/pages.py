"""Campaigns: the list, one campaign's design coverage, settings achieved and findings with their charts, and ingest by
upload or by the path of a folder on the server's machine."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Literal, cast

from fastapi import APIRouter, Form
from fastapi.concurrency import run_in_threadpool
from starlette.datastructures import UploadFile
from starlette.requests import Request
from starlette.responses import Response

from ...ingest.settings import ExtractionSettings
from ...schema.session import Store
from ..common.number_format import signed_percent
from ..common.quantities import display_of
from ..jobs.queue import JobView
from ..plan.pages import coverage_figure
from ..web.dependencies import Configured, Name, OpenStore, Running
from ..web.figures_base import Figure, figure, line, points
from ..web.jobs import Jobs
from ..web.jobs_pages import followed
from ..web.rendering import cell, heading, page, query
from ..web.settings import Settings
from .campaign_overview import KINDS, campaign_overview, list_campaigns_page
from .job import discard, make_scratch
from .uploads import MOST_FILES, UploadError, campaigns_below, confined, ingest_job, unpacked


def achieved_figure(rows: Sequence[Mapping[str, Any]], quantity: str) -> Figure:
    """Achieved (mean, least and largest of a run) over planned, of one quantity of `achieved.achieved_settings`."""
    quantity_rows = [row for row in rows if row["quantity"] == quantity]
    scale = display_of(quantity).scale
    planned = [row["planned"] * scale for row in quantity_rows]
    mean = [row["mean"] * scale for row in quantity_rows]
    bars = {
        "type": "data",
        "symmetric": False,
        "array": [row["largest"] * scale - m for row, m in zip(quantity_rows, mean, strict=True)],
        "arrayminus": [m - row["least"] * scale for row, m in zip(quantity_rows, mean, strict=True)],
        "color": "c0/0.5",
    }
    names = [f"{row['plan']}, run {row['run']}" for row in quantity_rows]
    ends = [min(planned + mean), max(planned + mean)]
    return figure(
        [
            line(ends, ends, "as planned", "quiet", dash="dash"),
            points(planned, mean, "runs", "c0", error_y=bars, text=names),
        ],
        f"planned {heading(quantity)}",
        "achieved",
        showlegend=False,
    )


router = APIRouter()
PAGE = 50


@router.get("/campaigns")
def campaigns(request: Request, store: OpenStore, kind: str = "", name: str = "", after: str = "") -> Response:
    with store.reading() as session:
        rows, following = list_campaigns_page(session, kind=kind or None, text=name, after=after or None, limit=PAGE)
    filters = {"kind": kind, "name": name}
    return page(
        request,
        "campaigns.html",
        rows=rows,
        kinds=KINDS,
        kind=kind,
        name=name,
        following=query({**filters, "after": following}) if following else "",
        beginning=(query(filters) or "/campaigns") if after else "",
    )


@router.get("/campaigns/{name}")
def campaign(request: Request, name: Name, store: OpenStore) -> Response:
    with store.reading() as session:
        overview = campaign_overview(session, name)
    levels, achieved = overview["levels"], overview["achieved"]
    factors = dict.fromkeys(row["factor"] for row in levels) if overview["plans"] else {}
    quantities = [summary["quantity"] for summary in overview["achieved_summary"]]
    return page(
        request,
        "campaign.html",
        **overview,
        coverage={factor: coverage_figure(levels, factor) for factor in factors},
        achieved_figures={quantity: achieved_figure(achieved, quantity) for quantity in quantities},
        levels_shown=[_level(row) for row in levels],
        achieved_shown=[_deviation(row) for row in overview["achieved_summary"]],
        bench=list(_bench(overview["campaign"]["bench"])),
    )


def _level(row: dict[str, Any]) -> dict[str, Any]:
    return {**row, "factor": heading(row["factor"]), "level": cell(row["factor"], row["level"])}


def _deviation(row: dict[str, Any]) -> dict[str, Any]:
    shares = ("mean_deviation", "mean_magnitude", "worst_deviation")
    return {**row, "quantity": heading(row["quantity"]), **{key: signed_percent(row[key]) for key in shares}}


def _bench(parts: dict[str, dict[str, Any]]) -> list[tuple[str, str, Any]]:
    every = [(part, key, value) for part, figures in parts.items() for key, value in figures.items()]
    return [entry for entry in every if entry[2] is not None]


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
        chosen = ExtractionSettings(segmentation=_method_of(segmentation), threshold=_number(threshold, 0.005))
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


def _method_of(text: object) -> Way:
    """Checked by the settings themselves."""
    return cast(Way, text or "walk")


def _number(text: object, default: float) -> float:
    if text is None or text == "":
        return default
    try:
        return float(str(text))
    except ValueError as error:
        raise UploadError(f"threshold {text!r} is no number; expected a share of the peak such as 0.005") from error
