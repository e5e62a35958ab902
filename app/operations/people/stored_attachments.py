"""Attached files in the store: added, listed, read, removed with a reason and restored."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import PurePosixPath
from typing import Any

from sqlalchemy import ColumnElement, select
from sqlalchemy.orm import Session

from ....schema.attached_files import AttachedFileError, is_shown, read_content, store_content
from ....schema.attachments import LONGEST_NAME, PICTURE_TYPES, AttachedContent, Attachment
from ....schema.campaign_rows import attached_to_campaign
from ....schema.person_roles import Person
from .subjects import Subject, author_columns


@dataclass(frozen=True)
class StoredAttachment:
    """An attached file without its content. `is_shown` says whether pages show it as a picture; a
    removed one says when, by whom and why."""

    key: int
    subject: Subject
    file_name: str
    media_type: str
    size_bytes: int
    sha256: str
    width_px: int | None
    height_px: int | None
    caption: str | None
    author: str
    author_kind: str
    attached_at: datetime
    removed_at: datetime | None
    removed_by: str | None
    removal_reason: str | None
    is_shown: bool

    @property
    def is_picture(self) -> bool:
        """Whether it is a picture, of whatever size."""
        return self.media_type in PICTURE_TYPES

    def to_json(self) -> dict[str, Any]:
        """As plain data."""
        plain = asdict(self)
        del plain["key"], plain["subject"], plain["is_shown"]
        moments = {
            name: None if plain[name] is None else plain[name].isoformat(timespec="seconds")
            for name in ("attached_at", "removed_at")
        }
        about = {"about": self.subject.kind, "subject": self.subject.text}
        return {"attachment": self.key, **about, **plain, **moments}


def clean_name(name: str) -> str:
    """The name of a file as it is stored: the last part of a path, as some browsers send it.

    Parameters:
        name: The name that the sender chose.

    Raises:
        ValueError: For a name that is empty, too long, or has characters that nobody sees.
    """
    last = PurePosixPath(name.replace("\\", "/").strip()).name.strip()
    if not last or last in (".", ".."):
        raise ValueError(f"file has the name {name!r:.120}; expected a name such as plate.jpg")
    if len(last) > LONGEST_NAME:
        raise ValueError(
            f"file has a name of {len(last)} letters ({last[:40]!r}…); expected at most "
            f"{LONGEST_NAME}: rename it"
        )
    if not last.isprintable():
        unseen = next(letter for letter in last if not letter.isprintable())
        raise ValueError(f"file has {unseen!r} in its name {last!r:.120}; rename it")
    return last


def add_attachment(
    session: Session,
    subject: Subject,
    file_name: str,
    content: bytes,
    caption: str | None,
    person: Person,
) -> int:
    """Attach a file; its number.

    Raises `ValueError` for a file that is not taken (`schema.attached_files`) and for one that is
    attached to the same thing already.
    """
    stored = store_content(session, content)
    same = select(Attachment).where(
        subject.is_of(Attachment),
        Attachment.content_id == stored.id,
        Attachment.removed_at.is_(None),
    )
    there = session.scalars(same.limit(1)).first()
    if there is not None:
        raise ValueError(
            f"file is attached to {subject.kind} {subject.text} already, as attachment {there.id} "
            f"({there.file_name})"
        )
    row = Attachment(
        **subject.columns(),
        **author_columns(person),
        content_id=stored.id,
        file_name=clean_name(file_name),
        caption=caption,
        attached_at=datetime.now(UTC),
    )
    session.add(row)
    session.flush()
    return row.id


def attachments_on(session: Session, subject: Subject) -> list[StoredAttachment]:
    """What is attached to one thing, the oldest first; what was removed is among it."""
    return attachments_where(session, subject.is_of(Attachment))


def attachments_of_campaign(session: Session, campaign_id: int) -> list[StoredAttachment]:
    """What is attached to a campaign and to its impacts, the oldest first."""
    return attachments_where(session, attached_to_campaign(campaign_id))


def attachments_where(session: Session, chosen: ColumnElement[bool]) -> list[StoredAttachment]:
    """The attachments that a condition chooses, the oldest first."""
    query = _query().where(chosen).order_by(Attachment.id)
    return [_stored(*row) for row in session.execute(query)]


def recent_attachments(
    session: Session, limit: int | None, before: int | None = None, *, removed: bool = True
) -> list[StoredAttachment]:
    """Attached files, the newest first: at most `limit`, of those older than number `before`; with
    those that were `removed`, or without."""
    query = _query().order_by(Attachment.id.desc()).limit(limit)
    if before is not None:
        query = query.where(Attachment.id < before)
    if not removed:
        query = query.where(Attachment.removed_at.is_(None))
    return [_stored(*row) for row in session.execute(query)]


def get_attachment(session: Session, key: int) -> StoredAttachment:
    """One attached file. Raises `LookupError`."""
    row = session.execute(_query().where(Attachment.id == key)).one_or_none()
    if row is None:
        raise LookupError(f"no attachment {key} in the store; pyroshock attachments lists them")
    return _stored(*row)


def content_of(session: Session, key: int) -> bytes:
    """The bytes of an attached file, which are those that were attached.

    Raises `LookupError` for an unknown one and for one that was removed, `AttachedFileError` where
    the store has other bytes.
    """
    attachment = get_attachment(session, key)
    if attachment.removed_at is not None:
        raise LookupError(
            f"attachment {key} ({attachment.file_name}) was removed: {attachment.removal_reason}; "
            f"to have it again: pyroshock attachments restore {key}"
        )
    query = select(AttachedContent).where(AttachedContent.sha256 == attachment.sha256)
    try:
        return read_content(session.connection(), session.scalars(query).one())
    except AttachedFileError as error:
        raise AttachedFileError(f"attachment {key} ({attachment.file_name}): {error}") from error


def remove_attachment(session: Session, key: int, reason: str, person: Person) -> StoredAttachment:
    """Take an attached file off; its row and its content stay. Raises `LookupError`, and
    `ValueError` for one that was removed already."""
    attachment = get_attachment(session, key)
    if attachment.removed_at is not None:
        raise ValueError(f"attachment {key} was removed already: {attachment.removal_reason}")
    row = session.get_one(Attachment, key)
    row.removed_at, row.removal_reason = datetime.now(UTC), reason
    row.removed_by, row.removed_by_kind = person.name, person.kind
    session.flush()
    return get_attachment(session, key)


def restore_attachment(session: Session, key: int) -> StoredAttachment:
    """Put a removed file back; the audit trail keeps why it was removed. Raises `LookupError`, and
    `ValueError` for one that was not removed."""
    attachment = get_attachment(session, key)
    if attachment.removed_at is None:
        raise ValueError(f"attachment {key} ({attachment.file_name}) was not removed")
    row = session.get_one(Attachment, key)
    row.removed_at = row.removed_by = row.removed_by_kind = row.removal_reason = None
    session.flush()
    return get_attachment(session, key)


def _query() -> Any:
    return select(Attachment, AttachedContent).join(
        AttachedContent, Attachment.content_id == AttachedContent.id
    )


def _stored(row: Attachment, content: AttachedContent) -> StoredAttachment:
    return StoredAttachment(
        key=row.id,
        subject=Subject(row.subject_kind, row.subject, row.run, row.repetition),
        file_name=row.file_name,
        media_type=content.media_type,
        size_bytes=content.size_bytes,
        sha256=content.sha256,
        width_px=content.width_px,
        height_px=content.height_px,
        caption=row.caption,
        author=row.author,
        author_kind=row.author_kind,
        attached_at=row.attached_at,
        removed_at=row.removed_at,
        removed_by=row.removed_by,
        removal_reason=row.removal_reason,
        is_shown=is_shown(content),
    )
