"""The form of a campaign that nobody has described yet: filled in with what the recordings say,
checked by a person, and written as campaign.toml and runs.csv."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from fastapi import APIRouter, Depends
from fastapi.concurrency import run_in_threadpool
from sqlalchemy import select
from starlette.datastructures import UploadFile
from starlette.requests import Request
from starlette.responses import RedirectResponse, Response

from ...ingest.errors import IngestError
from ...ingest.folder.bench_rules import RULES
from ...ingest.folder.campaign_tables import read_campaign_tables
from ...ingest.folder.column_names import KEYS, RUNS_FILE
from ...ingest.folder.description import CampaignDescription, read_description, read_rows
from ...ingest.folder.description_fields import (
    BENCH,
    CHANNEL_WORDS,
    COLUMN_WORDS,
    COLUMNS,
    FACTS,
    NEEDED_COLUMNS,
    NOT_USED,
    READING,
)
from ...ingest.folder.typed_values import plain_text
from ...schema.benches import Material
from ...schema.campaigns import Campaign
from ...schema.job_results import data_of
from ...schema.jobs import DONE, Job
from ...schema.session import Store
from ..jobs.queue import UnknownJobError
from ..operations.faults import Fault, FieldError, RequestError, read
from ..operations.ingest.bench_of_campaign import bench_of_campaign, with_bench
from ..operations.ingest.campaign_form import (
    ROLE_CHOICES,
    FormTexts,
    control_of,
    description_of,
    free_columns,
    kind_of,
    sent_form,
    texts_of,
)
from ..operations.ingest.describe import DESCRIBE, Description
from ..operations.ingest.folder import INGEST
from ..operations.ingest.request import FolderIngest
from ..operations.laboratory import Laboratory
from ..operations.machine_paths import CARD, MachinePath
from ..web.csrf import MOST_FIELDS
from ..web.dependencies import InLaboratory, Key, OpenStore, Running
from ..web.jobs import ask_operation, followed
from ..web.rendering import page
from ..web.role_needs import role_of

router = APIRouter()
#: Rows of the form's table. A longer one is filled in with a spreadsheet, and uploaded.
MOST_ROWS = 300
#: Campaigns whose bench the form offers.
_MOST_CAMPAIGNS = 200
_CHOICES: Mapping[str, tuple[str, ...]] = {
    "insulator": ("none", "polymeric"),
    "boundary_conditions": ("free", "fixed"),
    "hammer_speed": ("low", "high"),
}


@router.get("/ingest/forms/{job}")
def show(request: Request, job: Key, laboratory: InLaboratory, jobs: Running) -> Response:
    """How far the reading of the recordings is, then the form."""
    job_row, folder_request = jobs.get(job), _asked(laboratory.store, job)
    described = job_row.result if job_row.state == DONE else None
    values: dict[str, Any] = {"job": job_row, "ended": job_row.ended, "described": described}
    if described is None:
        return page(request, "campaign_form.html", **values)
    folder = folder_request.path.path
    there = folder.is_dir()
    description = _description(folder, described) if there else _proposed(described)
    kind = described["kind"] if not (folder / CARD).is_file() else kind_of(description)
    recorded = [channel["name"] for channel in described["channels"]]
    form = texts_of(kind, description, recorded, described["recordings"])
    names, materials = _names(laboratory.store)
    taken = request.query_params.get("bench", "")
    return page(
        request,
        "campaign_form.html",
        **values,
        there=there,
        uploaded=folder_request.path.scratch is not None,
        form=form,
        facts=FACTS,
        bench=BENCH,
        reading=READING,
        reading_needed=bool(described["unreadable"] or described["without_rate"]),
        channel_words=CHANNEL_WORDS,
        column_words=COLUMN_WORDS,
        needed=NEEDED_COLUMNS.get(kind, ()),
        columns=_columns(form),
        keys=KEYS,
        free=free_columns(form.columns),
        roles=ROLE_CHOICES,
        not_used=NOT_USED,
        units=_UNITS,
        recorded={channel["name"]: channel for channel in described["channels"]},
        sources=_sources(described, description, laboratory.store, taken),
        rules=RULES,
        campaigns=names,
        materials=materials,
        too_many=len(description.rows) > MOST_ROWS,
    )


_UNITS = {
    "force": ("N", "kN", "lbf"),
    "acceleration": ("m/s2", "g"),
    "pressure": ("bar", "kPa", "MPa", "Pa", "psi"),
    "displacement": ("mm", "m"),
    "velocity": ("m/s",),
    "voltage": ("V", "mV"),
    "strain": ("1",),
    "temperature": ("K", "degC"),
}


def _columns(form: FormTexts) -> list[dict[str, Any]]:
    """The columns of the table of runs with their words, and the kinds that have them."""
    columns = []
    for place, column in enumerate(form.columns):
        kinds = [kind for kind, own in COLUMNS.items() if column in own]
        words, why = COLUMN_WORDS.get(column, (column, "A factor of your own."))
        columns.append(
            {
                "place": place,
                "name": column,
                "words": words,
                "why": why,
                "kinds": " ".join(kinds) if kinds and column not in KEYS else "",
                "hidden": bool(kinds and form.kind and form.kind not in kinds),
                "choices": _CHOICES.get(column, ()),
                "is_material": column.endswith("_material"),
            }
        )
    return columns


def _asked(store: Store, key: int) -> Description:
    query = select(Job.arguments).where(Job.id == key, Job.kind == DESCRIBE.name)
    stored = store.read(lambda session: session.scalar(query))
    if stored is None:
        raise UnknownJobError(f"job {key} has no form of a campaign; its page is /jobs/{key}")
    return read(Description, stored, "stored")


def _proposed(described: Mapping[str, Any]) -> CampaignDescription:
    rows = tuple(described["rows"])
    return CampaignDescription(described["stated"], tuple(described["columns"]), rows)


def _description(folder: Path, described: Mapping[str, Any]) -> CampaignDescription:
    """What was written from the form before, or else what the recordings say."""
    if not (folder / CARD).is_file():
        return _proposed(described)
    return read_description(folder)


def _sources(
    described: Mapping[str, Any], description: CampaignDescription, store: Store, taken: str
) -> dict[str, str]:
    """Where each value is from, by the name of its key: of values that a person has not changed."""
    proposed = _proposed(described)
    sources = {
        name: words
        for name, words in described["sources"].items()
        if _unchanged(name, proposed, description)
    }
    if taken:
        bench = store.read(lambda session: bench_of_campaign(session, taken))
        for key in BENCH:
            value = bench.value(*key.keys)
            if value is not None and plain_text(value) == plain_text(description.value(*key.keys)):
                sources[key.name] = f"campaign {taken} of the store"
        for channel, facts in (bench.value("channels") or {}).items():
            for key in facts:
                if facts[key] == description.value("channels", channel, key):
                    sources.setdefault(
                        f"channels.{channel}.{key}", f"campaign {taken} of the store"
                    )
    return sources


def _unchanged(name: str, proposed: CampaignDescription, description: CampaignDescription) -> bool:
    if name.startswith("runs"):
        return True
    if name.startswith("channels."):
        channel, _, key = name.removeprefix("channels.").rpartition(".")
        keys: tuple[str, ...] = ("channels", channel, key)
    else:
        keys = tuple(name.split("."))
    return bool(proposed.value(*keys) == description.value(*keys))


def _names(store: Store) -> tuple[list[str], list[str]]:
    """Campaigns whose bench can be taken, the newest first, and the materials of the store."""
    with store.reading() as session:
        campaigns = session.scalars(
            select(Campaign.name).order_by(Campaign.id.desc()).limit(_MOST_CAMPAIGNS)
        )
        return list(campaigns), list(session.scalars(select(Material.name).order_by(Material.name)))


@router.post("/ingest/forms/{job}", dependencies=[Depends(role_of(INGEST))])
async def send(request: Request, job: Key, laboratory: InLaboratory, jobs: Running) -> Response:
    """Write both files from the form, and check the folder; or only write, and show it again."""
    async with request.form(max_fields=MOST_FIELDS) as sent:
        texts: dict[str, list[str]] = {}
        for name, text in sent.multi_items():
            if not isinstance(text, UploadFile):
                texts.setdefault(name, []).append(text)
    return await run_in_threadpool(_sent, job, texts, laboratory, jobs)


def _sent(job: int, texts: dict[str, list[str]], laboratory: Laboratory, jobs: Any) -> Response:
    folder_request = _asked(laboratory.store, job)
    folder = folder_request.path.readable(laboratory)
    form = sent_form(texts)
    if "column" not in texts:  # a table that is too long for the form stays as it is
        described = jobs.get(job).result or {}
        stated = _description(folder, described)
        form = _with_rows(form, texts_of(form.kind, stated))
    description = description_of(form)
    wanted = next(iter(texts.get("then", ())), "check")
    other_campaign = next(iter(texts.get("bench_of", ())), "")
    if wanted == "bench":
        if not other_campaign:
            raise FieldError("bench_of", "Choose the campaign whose bench it is.")
        stored_bench = laboratory.store.read(
            lambda session: bench_of_campaign(session, other_campaign)
        )
        description = with_bench(description, stored_bench, form.kind)
    _write(description, folder, uploaded=folder_request.path.scratch is not None)
    if wanted in ("bench", "column"):
        query = f"?bench={other_campaign}" if wanted == "bench" else ""
        return RedirectResponse(f"/ingest/forms/{job}{query}", 303)
    if wanted == "read":
        check_request = read(
            Description, {"path": folder_request.path, "kind": folder_request.kind}, "stored"
        )
        return followed(ask_operation(DESCRIBE, check_request, laboratory, jobs))
    _refuse_faults(laboratory.store, folder, form)
    path = MachinePath(path=folder_request.path.path, scratch=folder_request.path.scratch, form=job)
    checked = read(FolderIngest, {"path": path, "dry_run": True}, "stored")
    return followed(ask_operation(INGEST, checked, laboratory, jobs))


def _with_rows(form: FormTexts, stated: FormTexts) -> FormTexts:
    own = vars(form)
    return FormTexts(
        **{**own, "columns": stated.columns, "shared": stated.shared, "rows": stated.rows}
    )


def _write(description: CampaignDescription, folder: Path, *, uploaded: bool) -> None:
    """Both files of the folder. A table of runs that a person made is not touched where the form
    says the same, and a spreadsheet gives way to runs.csv in an upload alone."""
    columns, rows = read_rows(folder)
    spreadsheet = next(folder.glob("runs.xls*"), None)
    same = (columns, rows) == (description.columns, description.rows)
    if spreadsheet is not None and not same and not uploaded:
        raise ValueError(
            f"the runs stand in {spreadsheet.name} of the folder, which the form does not change; "
            "change them there, or upload the recordings"
        )
    try:
        if spreadsheet is not None and not same:
            spreadsheet.unlink()
        (folder / CARD).write_text(description.campaign_text(), encoding="utf-8", newline="")
        if not same:
            (folder / RUNS_FILE).write_text(description.runs_text(), encoding="utf-8", newline="")
    except OSError as error:
        raise ValueError(
            f"campaign.toml cannot be written to the folder ({error.strerror}); upload the "
            "recordings instead"
        ) from error


def _refuse_faults(store: Store, folder: Path, form: FormTexts) -> None:
    """Raise `RequestError` with what the two files lack, each beside its control."""
    try:
        read_campaign_tables(store, folder)
    except IngestError as error:
        faults = [control_of(fault, form) for fault in error.faults]
        raise RequestError([Fault(name, words) for name, words in faults]) from error


@router.get("/ingest/forms/{job}/files/{name}")
def file(job: Key, name: str, store: OpenStore, jobs: Running) -> Response:
    """campaign.toml or runs.csv as the form stands, to keep beside the recordings."""
    folder = _asked(store, job).path.path
    described = jobs.get(job).result
    if name not in (CARD, RUNS_FILE) or not described:
        raise LookupError(f"no file {name!r} belongs to the form")
    description = _description(folder, described)
    text = description.campaign_text() if name == CARD else description.runs_text()
    return text_file(name, text)


@router.get("/ingest/checks/{job}/files/{name}")
def checked_file(job: Key, name: str, store: OpenStore) -> Response:
    """campaign.toml or runs.csv as a form has written them for a check."""
    query = select(Job.result).where(Job.id == job, Job.kind == "check")
    result = data_of(store.read(lambda session: session.scalar(query))) or {}
    text = (result.get("written") or {}).get(name)
    if text is None:
        raise LookupError(f"check {job} has no file {name!r} that a form has written")
    return text_file(name, text)


def text_file(name: str, text: str) -> Response:
    """A text that a browser saves under its name.

    Parameters:
        name: The name of the file.
        text: Its content.
    """
    headers = {"content-disposition": f'attachment; filename="{name}"'}
    kind = "text/csv" if name == RUNS_FILE else "application/toml"
    return Response(text, media_type=f"{kind}; charset=utf-8", headers=headers)
