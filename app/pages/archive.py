"""Archive of a campaign, the list of what was deleted or archived, and the way back."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from fastapi import APIRouter, Depends
from fastapi.concurrency import run_in_threadpool
from starlette.datastructures import UploadFile
from starlette.requests import Request
from starlette.responses import FileResponse, RedirectResponse, Response

from ...schema.provenance import RECORDING, Tombstone
from ...schema.session import Store
from ..jobs.queue import JobView
from ..operations.faults import FieldError, read
from ..operations.ingest.archiving import kept_archive
from ..operations.ingest.campaigns import RESTORE, CampaignReturn
from ..operations.ingest.discarded import can_restore, restore_recording
from ..operations.ingest.removal import list_tombstones, standing_on
from ..operations.ingest.removed import standing_lines
from ..operations.laboratory import Laboratory
from ..operations.machine_paths import MachinePath
from ..operations.upload_folders import discard, make_scratch
from ..web.dependencies import Configured, InLaboratory, Key, Name, OpenStore, Running
from ..web.jobs import Jobs, ask_operation, followed
from ..web.rendering import page, part
from ..web.role_needs import role_of
from ..web.uploads import UploadError, copy_file

router = APIRouter()
#: The newest of what was deleted.
_MOST = 300


@router.get("/campaigns/{name}/archive")
def ask_archive(request: Request, name: Name, store: OpenStore, settings: Configured) -> Response:
    standing = standing_on(store, settings.db, name)
    return page(request, "archive.html", campaign=name, lines=standing_lines(standing))


@router.get("/deleted")
def deleted(request: Request, store: OpenStore, settings: Configured) -> Response:
    with store.reading() as session:
        stones = list_tombstones(session)[::-1][:_MOST]
    return page(request, "deleted.html", rows=[_line(stone, settings.db) for stone in stones])


def _line(stone: dict[str, Any], db: str) -> dict[str, Any]:
    return {
        **stone,
        "lines": standing_lines(stone),
        "archive_name": Path(stone["archive_path"] or "").name,
        "recording_kept": can_restore(db, stone),
        "file": stone["restored_at"] is None
        and kept_archive(db, stone["archive_path"]) is not None,
    }


@router.get("/deleted/{stone}/file")
def archived_file(stone: Key, store: OpenStore, settings: Configured) -> Response:
    """The file of an archive, to keep elsewhere."""
    campaign, file = _archive_of(store, settings.db, stone)
    return FileResponse(
        file, filename=f"{campaign}.pyroshock", media_type="application/octet-stream"
    )


@router.post("/deleted/{stone}/restore", dependencies=[Depends(role_of(RESTORE))])
def restore(stone: Key, laboratory: InLaboratory, jobs: Running) -> Response:
    """Bring an archived campaign, or a discarded recording, back from the file of this machine."""
    with laboratory.store.reading() as session:
        row = session.get(Tombstone, stone)
        is_recording = row is not None and row.kind == RECORDING
    if is_recording:
        restored = restore_recording(laboratory.store, laboratory.db, stone)
        return RedirectResponse(f"/campaigns/{part(restored['campaign'])}", 303)
    _campaign, file = _archive_of(laboratory.store, laboratory.db, stone)
    return followed(_asked(MachinePath(path=file), laboratory, jobs))


def _asked(file: MachinePath, laboratory: Laboratory, jobs: Jobs) -> JobView:
    request = read(CampaignReturn, {"file": file}, "network")
    return ask_operation(RESTORE, request, laboratory, jobs)


def _archive_of(store: Store, db: str, key: int) -> tuple[str, Path]:
    with store.reading() as session:
        stone = session.get(Tombstone, key)
        campaign, path = ("", None) if stone is None else (stone.campaign, stone.archive_path)
    file = kept_archive(db, path)
    if file is None:
        raise LookupError(
            f"deletion {key} has no archive on this machine; upload the file "
            f"to restore the campaign"
        )
    return campaign, file


@router.post("/ingest/restore", dependencies=[Depends(role_of(RESTORE))])
async def restore_upload(
    request: Request, laboratory: InLaboratory, jobs: Running, settings: Configured
) -> Response:
    """Bring a deleted campaign back from a file that was saved before."""
    async with request.form(max_files=2) as form:
        upload = form.get("file")
        if not isinstance(upload, UploadFile) or not upload.filename:
            raise FieldError("file", "No file was sent; choose a file that ends in .pyroshock.")
        scratch = make_scratch()
        try:
            file = scratch / "campaign.pyroshock"
            await run_in_threadpool(copy_file, upload.file, file, settings.max_upload_bytes)
            path = MachinePath(path=file, scratch=scratch)
            job = await run_in_threadpool(_asked, path, laboratory, jobs)
        except UploadError as error:
            discard(scratch)
            raise FieldError("file", str(error)) from error
        except BaseException:  # an interruption, too, leaves no upload behind; it is raised again
            discard(scratch)
            raise
    return followed(job)
