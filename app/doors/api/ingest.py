"""Campaigns: listed page by page, one with all that its page shows, ingested as a job, deleted, and
what stands on them."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from fastapi import APIRouter, Query
from pydantic import BaseModel, Field
from starlette.requests import Request

from ....ingest.extraction.settings import ExtractionSettings
from ....schema.removal.part import recording_part
from ...common.number_format import finite
from ...operations.ingest.campaign_overview import campaign_overview, list_campaigns_page
from ...operations.ingest.removal import (
    delete_campaign,
    discard_recording,
    list_tombstones,
    standing_on,
)
from ...web.dependencies import Configured, Name, OpenStore, Running, Text
from ...web.uploads import campaigns_below, confined, ingest_job, uploaded

router = APIRouter(tags=["campaigns"])


@router.get("/campaigns")
def campaigns(
    store: OpenStore,
    kind: Literal["gun", "hammer"] | None = None,
    name: str = "",
    after: str | None = None,
    limit: Annotated[int, Query(ge=1, le=1000)] = 100,
) -> list[dict[str, Any]]:
    """Campaigns, the newest first; the next page begins `after` the last name of this one."""
    with store.reading() as session:
        return list_campaigns_page(session, kind=kind, text=name, after=after, limit=limit)[0]


@router.get("/campaigns/{name}")
def campaign(name: Name, store: OpenStore) -> Any:
    """Design coverage, achieved against planned settings, findings, first impacts and shots."""
    with store.reading() as session:
        return finite(campaign_overview(session, name))


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
    return ingest_job(
        jobs, store, confined(folder.path, settings.folders), chosen, folder.plan
    ).as_json()


@router.post("/ingest/upload", openapi_extra=_FORM)
async def upload(
    request: Request, store: OpenStore, jobs: Running, settings: Configured
) -> dict[str, Any]:
    """Ingest uploaded files: those of one campaign folder with their paths within it, or one
    ZIP."""
    return (await uploaded(request, store, jobs, settings)).as_json()


class Deletion(BaseModel):
    """Why it goes: is kept with the tombstone."""

    reason: Text = Field(max_length=4000)


class Discard(Deletion):
    """`recording` is its path, as in runs.csv."""

    recording: Text = Field(max_length=4000)


@router.get("/deleted")
def deleted(store: OpenStore, campaign: str | None = None) -> list[dict[str, Any]]:
    """Tombstones: what was deleted, when, why, and what stood on it, the oldest first."""
    with store.reading() as session:
        return list_tombstones(session, campaign)


@router.get("/campaigns/{name}/standing")
def standing(
    name: Name,
    store: OpenStore,
    settings: Configured,
    recording: Annotated[str | None, Query(max_length=4000)] = None,
) -> dict[str, Any]:
    """Rows that would go with a campaign, or with one recording of it, and what stands on them;
    nothing is written."""
    return standing_on(store, settings.db, name, recording)


@router.post("/campaigns/{name}/delete")
def delete(
    name: Name, deletion: Deletion, store: OpenStore, settings: Configured
) -> dict[str, Any]:
    """Delete a campaign; answers with its tombstone."""
    return delete_campaign(store, settings.db, name, deletion.reason)


@router.post("/campaigns/{name}/discard")
def discard(
    name: Name, discarded: Discard, store: OpenStore, settings: Configured
) -> dict[str, Any]:
    """Take one recording out of the store; answers with its tombstone."""
    with store.reading() as session:
        part = recording_part(session, name, discarded.recording)
    return discard_recording(store, settings.db, part, discarded.reason)
