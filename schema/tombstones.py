"""What was deleted from the store, and what stood on it: nothing that was used disappears without a word."""

from __future__ import annotations

from datetime import datetime
from typing import Any

from sqlalchemy import CheckConstraint
from sqlalchemy.orm import Mapped

from .base import Base, HasId, Written, one_of

CAMPAIGN, RECORDING = KINDS = ("campaign", "recording")


class Tombstone(HasId, Written, Base):
    """One deletion: of a campaign with all that was its own, or of a recording with its hits.

    `content_hash` is of what was deleted (`removal.content`): the same content, ingested again, has it again.
    """

    __tablename__ = "tombstones"
    __table_args__ = (
        CheckConstraint(one_of("kind", KINDS), "kind_known"),
        CheckConstraint("length(content_hash) = 64", "content_hash_length"),
        CheckConstraint("(kind = 'recording') = (recording IS NOT NULL)", "recording_named"),
        CheckConstraint("length(reason) > 0", "with_reason"),
    )

    kind: Mapped[str]
    campaign: Mapped[str]
    recording: Mapped[str | None]  # its path in the campaign folder
    content_hash: Mapped[str]
    deleted_at: Mapped[datetime]
    reason: Mapped[str]
    counts: Mapped[dict[str, Any]]  # rows by table
    #: "datasets": name, hash, pulses that it lost, pulses that it had before; "models": label, dataset, hash;
    #: "diagnoses": of a campaign with their report; "adopted": versions of the twin's configuration; "reopened":
    #: planned runs that are to do again.
    stood_on: Mapped[dict[str, Any]]
