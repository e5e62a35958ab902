"""Who wrote a row, one entry per command that changed the store; and what was deleted, and what
stood on it: nothing that was used disappears without a word."""

from __future__ import annotations

from datetime import datetime
from typing import Any

from sqlalchemy import CheckConstraint
from sqlalchemy.orm import Mapped, mapped_column

from .base import Base, HasId, WithProvenance, names_row, one_of


class Provenance(HasId, Base):
    """A run of the software that wrote something."""

    __tablename__ = "provenance"

    software_version: Mapped[str]
    command: Mapped[str] = mapped_column(info=names_row("command"))
    user: Mapped[str]
    host: Mapped[str]
    started_at: Mapped[datetime] = mapped_column()


CAMPAIGN, RECORDING = KINDS = ("campaign", "recording")


def _hash_of(column: str, kind: str) -> str:
    return f"{column} IS NULL OR (length({column}) = 64 AND kind = '{kind}')"


class Tombstone(HasId, WithProvenance, Base):
    """One deletion: of a campaign with all that was its own, or of a recording with its hits.

    `content_hash` is of what was deleted (`removal.content`): the same content, ingested again, has
    it again. A recording's tombstone is open until `restored_at` (the same file is stored again) or
    `replaced_by` is set.
    """

    __tablename__ = "tombstones"
    __table_args__ = (
        CheckConstraint(one_of("kind", KINDS), "kind_known"),
        CheckConstraint("length(content_hash) = 64", "content_hash_length"),
        CheckConstraint("(kind = 'recording') = (recording IS NOT NULL)", "recording_named"),
        CheckConstraint("length(reason) > 0", "with_reason"),
        CheckConstraint(_hash_of("file_sha256", RECORDING), "file_sha256_of_recording"),
        CheckConstraint(_hash_of("replaced_by", RECORDING), "replaced_by_of_recording"),
        CheckConstraint(_hash_of("archive_sha256", CAMPAIGN), "archive_of_campaign"),
        CheckConstraint("(archive_path IS NULL) = (archive_sha256 IS NULL)", "archive_with_sha256"),
    )

    kind: Mapped[str]
    campaign: Mapped[str] = mapped_column(info=names_row("campaign"))
    recording: Mapped[str | None] = mapped_column(
        info=names_row("recording")
    )  # its path in the campaign folder
    content_hash: Mapped[str]
    deleted_at: Mapped[datetime]
    reason: Mapped[str]
    counts: Mapped[dict[str, Any]]  # rows by table
    #: "datasets": name, hash, pulses that it lost, pulses that it had before, the lost ones'
    #: digests ("members", `removal.returning`), how many of them it has again ("returned");
    #: "models": label, dataset, hash; "diagnoses": of a campaign with their report; "adopted":
    #: versions of the twin's configuration; "reopened": planned runs that are to do again;
    #: "shot": planned runs with hits, and when the first of each was stored.
    stood_on: Mapped[dict[str, Any]]
    file_sha256: Mapped[str | None]  # of the recording's file
    replaced_by: Mapped[str | None]  # SHA-256 of the file that is stored in its place
    archive_path: Mapped[str | None]  # of the file that the campaign was written to before
    archive_sha256: Mapped[str | None]
    restored_at: Mapped[datetime | None]
