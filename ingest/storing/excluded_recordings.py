"""Recordings that could not be read, where a row says why until the file is mended; and those that
were discarded: an ingest recognises their files, and stores none of them unasked."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from typing import Any

from sqlalchemy import bindparam, func, select
from sqlalchemy.orm import Session

from ...schema.access.append_only import delete_set_aside
from ...schema.campaigns import Campaign
from ...schema.provenance import CAMPAIGN, Tombstone
from ...schema.recordings import SET_ASIDE, Recording
from ...schema.removal.part import Part
from ...schema.removal.returning import open_tombstones, settle
from ...schema.transactions import get_or_add
from ..errors import IngestError
from ..extraction.recording import UnreadableRecording
from ..folder.campaign_file import CampaignFile
from ..readers.recording_files import RecordingFiles
from .report import DISCARDED


def store_unreadable(
    session: Session, campaign: Campaign, file: CampaignFile, item: UnreadableRecording
) -> None:
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


_SET_ASIDE = select(Recording.id).where(
    Recording.campaign_id == bindparam("campaign"),
    Recording.path == bindparam("path"),
    Recording.status == SET_ASIDE,
)


def delete_unreadable(session: Session, campaign: Campaign, path: str) -> None:
    """A recording that was set aside and has been mended makes room for its better self."""
    connection = session.connection()
    for key in connection.scalars(_SET_ASIDE, {"campaign": campaign.id, "path": path}).all():
        delete_set_aside(connection, key)


@dataclass(frozen=True)
class Discarded:
    """A tombstone of a recording. `current`: of the campaign as it is now, not of one of its name
    before it."""

    path: str
    sha256: str | None
    date: str
    reason: str
    current: bool

    def finding(self) -> dict[str, Any]:
        """What an ingest says of it, in the form of a report's findings."""
        message = (
            f"recording {self.path} was discarded on {self.date} because {self.reason}; not stored "
            f"again (to store it again: pyroshock ingest FOLDER --again {self.path})"
        )
        return {
            "recording": self.path, "channel": None, "check": DISCARDED, "severity": "note",
            "message": message
        }  # fmt: skip


class DiscardedRecordings:
    """The discarded recordings of a campaign, without those that are asked for `again`."""

    def __init__(self, session: Session, campaign: str, again: Collection[str] = ()) -> None:
        last = select(func.max(Tombstone.id)).where(
            Tombstone.kind == CAMPAIGN, Tombstone.campaign == campaign
        )
        newest_deletion = session.scalar(last) or 0
        self._again = frozenset(again)
        self._stones = {
            stone.recording: Discarded(
                stone.recording,
                stone.file_sha256,
                f"{stone.deleted_at:%Y-%m-%d}",
                stone.reason,
                stone.id > newest_deletion,
            )
            for stone in open_tombstones(session, campaign)
            if stone.recording is not None
        }
        self.withheld: list[Discarded] = []

    def withhold(self, path: str, sha256: str) -> bool:
        """Whether this file was discarded and nobody asks for it again; it is then listed in
        `withheld`.

        Raises `IngestError` for another file in the place of a discarded one: it must be asked for.
        """
        stone = self._stones.get(path)
        if stone is None or path in self._again:
            return False
        if stone.sha256 in (None, sha256):
            self.withheld.append(stone)
            return True
        if not stone.current:
            return False
        raise IngestError(
            f"{path}: recording {path} was discarded on {stone.date} because {stone.reason}, and "
            "another file is in its place now (SHA-256 "
            f"{stone.sha256[:12] if stone.sha256 else '?'}… was discarded, {sha256[:12]}… is "
            f"there); to store it: pyroshock ingest FOLDER --again {path}"
        )

    def settle(self, session: Session, part: Part, sha256: str, written_by: int) -> None:
        """Say on the tombstone that the recording is stored; datasets get the pulses back that
        agree."""
        if part.recording in self._stones:
            settle(session, part, sha256, written_by)
