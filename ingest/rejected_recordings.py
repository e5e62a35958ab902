"""Recordings that could not be read: a row says why, until the file is mended."""

from __future__ import annotations

from dataclasses import dataclass

from sqlalchemy import delete
from sqlalchemy.orm import Session

from ..schema.campaigns import Campaign
from ..schema.keys import get_or_add
from ..schema.recordings import SET_ASIDE, Recording
from .folder import CampaignFile
from .recording_files import RecordingFiles


@dataclass(frozen=True)
class Damaged:
    """A recording that could not be read whole, and why."""

    path: str
    sha256: str
    size_bytes: int
    reason: str


def keep_aside(session: Session, campaign: Campaign, file: CampaignFile, item: Damaged) -> None:
    """Add the row that says why, unless another process has."""
    get_or_add(
        session,
        Recording,
        {"campaign_id": campaign.id, "path": item.path},
        {
            "sha256": item.sha256,
            "size_bytes": item.size_bytes,
            "format": RecordingFiles(file.folder, item.path).format,
            "status": SET_ASIDE,
            "reason": item.reason,
        },
    )


def forget_aside(session: Session, campaign: Campaign, path: str) -> None:
    """A recording that was set aside and has been mended makes room for its better self."""
    session.execute(
        delete(Recording).where(
            Recording.campaign_id == campaign.id, Recording.path == path, Recording.status == SET_ASIDE
        )
    )
