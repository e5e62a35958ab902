"""Ingest of campaigns: each answers with its job."""

from __future__ import annotations

from typing import Any, Literal

from fastapi import APIRouter
from pydantic import BaseModel, Field
from starlette.requests import Request

from ....ingest.settings import ExtractionSettings
from ..dependencies import Configured, OpenStore, Running, Text
from ..folders import campaigns_below, confined
from ..ingesting import ingest_job
from ..pages.ingest import uploaded

router = APIRouter(tags=["ingest"])

_FORM = {
    "requestBody": {
        "required": True,
        "content": {
            "multipart/form-data": {
                "schema": {
                    "type": "object",
                    "required": ["files"],
                    "properties": {
                        "files": {"type": "array", "items": {"type": "string", "format": "binary"}},
                        "plan": {"type": "string"},
                        "segmentation": {"type": "string", "enum": ["walk", "mask"]},
                        "threshold": {"type": "number"},
                    },
                }
            }
        },
    }
}


class Folder(BaseModel):
    """A campaign folder below those that the server may read."""

    path: str = Field(max_length=4000)
    plan: Text | None = Field(None, max_length=200)
    segmentation: Literal["walk", "mask"] = "walk"
    threshold: float = 0.005


@router.get("/ingest/folders")
def folders(settings: Configured) -> list[str]:
    """Campaign folders that the server may read."""
    return campaigns_below(settings.folders)


@router.post("/ingest")
def ingest(folder: Folder, store: OpenStore, jobs: Running, settings: Configured) -> dict[str, Any]:
    """Ingest a folder of the server's machine; answers with the job."""
    chosen = ExtractionSettings(segmentation=folder.segmentation, threshold=folder.threshold)
    return ingest_job(jobs, store, confined(folder.path, settings.folders), chosen, folder.plan).as_json()


@router.post("/ingest/upload", openapi_extra=_FORM)
async def upload(request: Request, store: OpenStore, jobs: Running, settings: Configured) -> dict[str, Any]:
    """Ingest uploaded files: those of one campaign folder with their paths within it, or one ZIP."""
    return (await uploaded(request, store, jobs, settings)).as_json()
