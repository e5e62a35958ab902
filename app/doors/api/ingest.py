"""Campaign folders that the server may read, and the ingest of an upload as a job."""

from __future__ import annotations

from typing import Any

from fastapi import APIRouter, Depends
from starlette.requests import Request

from ...operations.ingest.folder import INGEST
from ...operations.machine_paths import campaigns_below
from ...web.dependencies import Configured, InLaboratory, Running
from ...web.role_needs import role_of
from ...web.uploads import asked_of_upload, upload_form

router = APIRouter(tags=["campaigns"])


@router.get("/ingest/folders")
def folders(settings: Configured) -> list[str]:
    """Campaign folders that the server may read."""
    return campaigns_below(settings.folders)


@router.post("/ingest/upload", openapi_extra=upload_form(), dependencies=[Depends(role_of(INGEST))])
async def upload(
    request: Request, laboratory: InLaboratory, jobs: Running, settings: Configured
) -> dict[str, Any]:
    """Ingest uploaded files: those of one campaign folder with their paths within it, or one ZIP;
    the other fields are those of the ingest."""
    return (await asked_of_upload(request, laboratory, jobs, settings)).as_json()
