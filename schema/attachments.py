"""Photographs and documents that people attach to campaigns, runs, impacts and plans.

A row says what a file is about, by the names that people use (`schema.notes`), and who attached it.
The content lies once under its SHA-256, however often it is attached, in pieces that a table of
their own holds: no listing touches them.
"""

from __future__ import annotations

from datetime import datetime

from sqlalchemy import CheckConstraint, ForeignKey, LargeBinary, Text, UniqueConstraint
from sqlalchemy.orm import Mapped, mapped_column

from .base import Base, HasId, WithProvenance, names_row, one_of
from .notes import CAMPAIGN, IMPACT, RUN, AboutSubject, ByPerson
from .person_roles import PERSON_KINDS

PLAN = "plan"
ATTACHED_TO = (CAMPAIGN, RUN, IMPACT, PLAN)
#: Letters of a file's name.
LONGEST_NAME = 200
#: Media types of pictures, which pages and reports show, and of what is only handed out as a file.
PICTURE_TYPES = ("image/jpeg", "image/png", "image/gif", "image/webp")
DOCUMENT_TYPES = (
    "application/pdf",
    "text/plain",
    "application/zip",
    "application/vnd.openxmlformats-officedocument.wordprocessingml.document",
    "application/vnd.openxmlformats-officedocument.spreadsheetml.sheet",
    "application/vnd.openxmlformats-officedocument.presentationml.presentation",
    "application/vnd.oasis.opendocument.text",
    "application/vnd.oasis.opendocument.spreadsheet",
    "application/vnd.oasis.opendocument.presentation",
)
MEDIA_TYPES = (*PICTURE_TYPES, *DOCUMENT_TYPES)


class AttachedContent(HasId, WithProvenance, Base):
    """The content of a file: known by its SHA-256, and of a kind that its bytes say."""

    __tablename__ = "attached_contents"
    __table_args__ = (
        CheckConstraint("length(sha256) = 64", "sha256_length"),
        CheckConstraint("size_bytes > 0", "size_positive"),
        CheckConstraint(one_of("media_type", MEDIA_TYPES), "media_type_known"),
        CheckConstraint("(width_px IS NULL) = (height_px IS NULL)", "both_sides"),
    )

    sha256: Mapped[str] = mapped_column(unique=True, info=names_row("content"))
    size_bytes: Mapped[int]
    media_type: Mapped[str]
    width_px: Mapped[int | None]  # of a picture, as its header says
    height_px: Mapped[int | None]


class AttachedPiece(WithProvenance, Base):
    """Consecutive bytes of a content (`attached_files.PIECE_BYTES`, the last one fewer)."""

    __tablename__ = "attached_pieces"

    content_id: Mapped[int] = mapped_column(ForeignKey("attached_contents.id"), primary_key=True)
    number: Mapped[int] = mapped_column(primary_key=True, info=names_row("piece"))
    data: Mapped[bytes] = mapped_column(LargeBinary)


_SUBJECT = ("subject_kind", "subject", "run", "repetition")
#: Shorter than the names of all columns, which PostgreSQL would refuse.
_UNIQUE = "uq_attachments_subject_content_moment"
_REMOVED = ("removed_at", "removed_by", "removed_by_kind", "removal_reason")


class Attachment(HasId, WithProvenance, AboutSubject, ByPerson, Base):
    """A file that is attached to something. One that was removed keeps its row and its content,
    says who removed it and why, and can be restored."""

    __tablename__ = "attachments"
    __table_args__ = (
        CheckConstraint(one_of("subject_kind", ATTACHED_TO), "subject_kind_known"),
        CheckConstraint(one_of("author_kind", PERSON_KINDS), "author_kind_known"),
        CheckConstraint(
            f"removed_by_kind IS NULL OR {one_of('removed_by_kind', PERSON_KINDS)}",
            "removed_by_kind_known",
        ),
        CheckConstraint(f"length(file_name) BETWEEN 1 AND {LONGEST_NAME}", "file_name_length"),
        *(
            CheckConstraint(f"(removed_at IS NULL) = ({name} IS NULL)", f"removed_with_{name}")
            for name in _REMOVED[1:]
        ),
        # "what is attached to this", and: the same row from another store
        UniqueConstraint(*_SUBJECT, "content_id", "attached_at", name=_UNIQUE),
    )

    content_id: Mapped[int] = mapped_column(ForeignKey("attached_contents.id"), index=True)
    file_name: Mapped[str] = mapped_column(info=names_row("attachment"))
    caption: Mapped[str | None] = mapped_column(Text)
    attached_at: Mapped[datetime]
    removed_at: Mapped[datetime | None]
    removed_by: Mapped[str | None]
    removed_by_kind: Mapped[str | None]
    removal_reason: Mapped[str | None] = mapped_column(Text)
