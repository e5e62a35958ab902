"""The file of a campaign that is to leave the store: written, read back, and known by the hash of its content."""

from __future__ import annotations

import hashlib
import os
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from sqlalchemy import Connection, select
from sqlalchemy.orm import Session

from ..campaigns import Campaign
from ..care.progress import Progress
from ..removal.content import content_hash
from ..removal.part import campaign_part
from ..session import Store
from .export import export_campaign
from .opened_export import ForeignFileError, opened_file

_BLOCK = 2**20


@dataclass(frozen=True)
class Archive:
    """A file with one campaign: its absolute path, its SHA-256, and the hash of the campaign's content."""

    path: Path
    sha256: str
    campaign: str
    content_hash: str


def write_archive(store: Store, campaign: str, out: Path, progress: Progress | None = None) -> Archive:
    """Write the campaign to `out` and read the file back with every check of a file from elsewhere.

    A file that an earlier call has written whole is read back and taken as it is. Raises as `export_campaign`, and
    `ForeignFileError` where the file does not hold what the store holds; the store is not changed.
    """
    with store.reading() as session:
        expected = content_hash(session, campaign_part(session, campaign))
    if not out.exists():
        export_campaign(store, campaign, out, progress)
        _to_disk(out)
    archive = read_archive(out, progress)
    if (archive.campaign, archive.content_hash) != (campaign, expected):
        raise ForeignFileError(
            f"{out} does not hold campaign {campaign!r} as the store has it now; nothing was deleted: name a new file"
        )
    return archive


def read_archive(file: Path, progress: Progress | None = None) -> Archive:
    """What a file holds. Raises `ForeignFileError` where it does not pass its checks, or holds no single campaign."""
    with opened_file(file, progress) as origin:
        return archive_of(file, origin)


def archive_of(file: Path, origin: Connection) -> Archive:
    """The same of a file that is open and has passed its checks."""
    names = list(origin.scalars(select(Campaign.name).order_by(Campaign.name)))
    if len(names) != 1:
        raise ForeignFileError(
            f"{file} holds {len(names)} campaigns, an archive holds one; pyroshock db import takes it"
        )
    with Session(origin) as session:
        digest = content_hash(session, campaign_part(session, names[0]))
    return Archive(file.resolve(), _sha256(file), names[0], digest)


def _sha256(file: Path) -> str:
    digest = hashlib.sha256()
    with file.open("rb") as stream:
        while block := stream.read(_BLOCK):
            digest.update(block)
    return digest.hexdigest()


def _to_disk(file: Path) -> None:
    """Until it lies on the disk, the file is no reason to delete anything."""
    for path in (file, file.resolve().parent):
        with suppress(PermissionError, IsADirectoryError):  # not every system opens a folder
            descriptor = os.open(path, os.O_RDONLY)
            try:
                os.fsync(descriptor)
            finally:
                os.close(descriptor)
