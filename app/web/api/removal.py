"""A campaign deleted, a recording discarded; what stands on them before."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Query
from pydantic import BaseModel, Field

from ....schema.removal.part import recording_part
from ...removal.deleting import delete_campaign, list_tombstones
from ...removal.recordings import discard_recording
from ...removal.standing import standing_on
from ..dependencies import Configured, Name, OpenStore, Text

router = APIRouter(tags=["campaigns"])


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
    """Rows that would go with a campaign, or with one recording of it, and what stands on them; nothing is written."""
    return standing_on(store, settings.db, name, recording)


@router.post("/campaigns/{name}/delete")
def delete(name: Name, deletion: Deletion, store: OpenStore, settings: Configured) -> dict[str, Any]:
    """Delete a campaign; answers with its tombstone."""
    return delete_campaign(store, settings.db, name, deletion.reason)


@router.post("/campaigns/{name}/discard")
def discard(name: Name, discarded: Discard, store: OpenStore, settings: Configured) -> dict[str, Any]:
    """Take one recording out of the store; answers with its tombstone."""
    with store.reading() as session:
        part = recording_part(session, name, discarded.recording)
    return discard_recording(store, settings.db, part, discarded.reason)
