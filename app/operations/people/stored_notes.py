"""Notes and tags in the store: read with all their versions, and written."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

from sqlalchemy import delete, func, select
from sqlalchemy.orm import Session

from ....schema.notes import Note, Tag
from ....schema.person_roles import ADMINISTRATOR, Person, RoleNeededError
from .subjects import Subject, author_columns


@dataclass(frozen=True)
class NoteVersion:
    """A text of a note, or the reason why it was withdrawn; who wrote it, and when."""

    text: str | None
    reason: str | None
    author: str
    author_kind: str
    written_at: datetime

    def to_json(self) -> dict[str, Any]:
        """As plain data."""
        return {**vars(self), "written_at": self.written_at.isoformat(timespec="seconds")}


@dataclass(frozen=True)
class StoredNote:
    """A note with what it is about and all its versions, the oldest first."""

    key: int
    subject: Subject
    versions: tuple[NoteVersion, ...]

    @property
    def author(self) -> str:
        """Who wrote it first."""
        return self.versions[0].author

    @property
    def last(self) -> NoteVersion:
        """What it says now."""
        return self.versions[-1]

    @property
    def withdrawn(self) -> bool:
        """Whether it says nothing any more."""
        return self.last.text is None

    def to_json(self) -> dict[str, Any]:
        """With the earlier versions, which stay."""
        return {
            "note": self.key,
            "about": self.subject.kind,
            "subject": self.subject.text,
            **self.last.to_json(),
            "earlier": [version.to_json() for version in self.versions[:-1]],
        }


class NotYourNoteError(RoleNeededError):
    """A note is changed by who wrote it; an administrator may withdraw it, too."""


def notes_on(session: Session, subject: Subject) -> list[StoredNote]:
    """The notes on one thing, the oldest first; those that were withdrawn are among them."""
    query = select(Note).where(subject.is_of(Note)).order_by(Note.id)
    return _notes(session.scalars(query).all())


def recent_notes(session: Session, limit: int, before: int | None = None) -> list[StoredNote]:
    """Notes on anything, the newest first: at most `limit`, of those older than number `before`."""
    first = select(Note.id).where(Note.first_id.is_(None)).order_by(Note.id.desc()).limit(limit)
    if before is not None:
        first = first.where(Note.id < before)
    keys = session.scalars(first).all()
    rows = session.scalars(
        select(Note).where(func.coalesce(Note.first_id, Note.id).in_(keys)).order_by(Note.id)
    ).all()
    return _notes(rows)[::-1]


def get_note(session: Session, key: int) -> StoredNote:
    """One note. Raises `LookupError`."""
    rows = session.scalars(
        select(Note).where((Note.id == key) | (Note.first_id == key)).order_by(Note.id)
    ).all()
    if not rows or rows[0].first_id is not None:
        raise LookupError(f"no note {key} in the store; pyroshock notes lists them")
    return _notes(rows)[0]


def _notes(rows: Sequence[Note]) -> list[StoredNote]:
    threads: dict[int, list[Note]] = {}
    for row in rows:
        threads.setdefault(row.first_id or row.id, []).append(row)
    return [
        StoredNote(
            key,
            Subject(own[0].subject_kind, own[0].subject, own[0].run, own[0].repetition),
            tuple(
                NoteVersion(row.text, row.reason, row.author, row.author_kind, row.written_at)
                for row in own
            ),
        )
        for key, own in threads.items()
    ]


def add_note(session: Session, subject: Subject, text: str, person: Person) -> int:
    """Write a note; its number."""
    row = Note(
        **subject.columns(), **author_columns(person), text=text, written_at=datetime.now(UTC)
    )
    session.add(row)
    session.flush()
    return row.id


def change_note(
    session: Session,
    key: int,
    person: Person,
    text: str | None = None,
    reason: str | None = None,
) -> StoredNote:
    """Add a version to a note: another text, or a reason that withdraws it. The note afterwards.

    Raises `LookupError`, and `NotYourNoteError` for a note of another person.
    """
    note = get_note(session, key)
    first = note.versions[0]
    own = (first.author, first.author_kind) == (person.name, person.kind)
    if not own and (text is not None or not person.may(ADMINISTRATOR)):
        raise NotYourNoteError(
            f"note {key} is by {first.author}, who alone changes its text; an administrator may "
            "withdraw it"
        )
    if note.withdrawn and text is None:
        raise ValueError(f"note {key} was withdrawn already: {note.last.reason}")
    session.add(
        Note(
            **note.subject.columns(),
            **author_columns(person),
            first_id=key,
            text=text,
            reason=reason,
            written_at=datetime.now(UTC),
        )
    )
    session.flush()
    return get_note(session, key)


# --- tags


def tags_on(session: Session, subject: Subject) -> list[str]:
    """The tags of one thing, by name."""
    return list(session.scalars(select(Tag.word).where(subject.is_of(Tag)).order_by(Tag.word)))


def tags_in_use(session: Session, kind: str) -> list[str]:
    """The tags of all things of a kind."""
    query = select(Tag.word).where(Tag.subject_kind == kind).distinct().order_by(Tag.word)
    return list(session.scalars(query))


def add_tag(session: Session, subject: Subject, word: str, person: Person) -> None:
    """Put a tag on something that may have it already."""
    own = select(Tag.id).where(subject.is_of(Tag), Tag.word == word)
    if session.scalar(own) is None:
        session.add(
            Tag(
                **subject.columns(),
                **author_columns(person),
                word=word,
                tagged_at=datetime.now(UTC),
            )
        )


def remove_tag(session: Session, subject: Subject, word: str) -> None:
    """Take a tag off. Raises `LookupError` where it is not on."""
    gone: Any = session.execute(delete(Tag).where(subject.is_of(Tag), Tag.word == word))
    if not gone.rowcount:
        raise LookupError(f"{subject.kind} {subject.text} has no tag {word!r}")


def tag_rows(session: Session, kind: str | None = None, word: str | None = None) -> list[Any]:
    """Tags with what they are on: every word with its number of things, or the things of a word."""
    if word is None:
        query = (
            select(Tag.word, Tag.subject_kind, func.count().label("number"))
            .group_by(Tag.word, Tag.subject_kind)
            .order_by(Tag.word, Tag.subject_kind)
        )
        if kind is not None:
            query = query.where(Tag.subject_kind == kind)
        return [
            {"tag": row.word, "about": row.subject_kind, "things": row.number}
            for row in session.execute(query)
        ]
    rows = select(Tag).where(Tag.word == word).order_by(Tag.id)
    if kind is not None:
        rows = rows.where(Tag.subject_kind == kind)
    return [
        {
            "tag": row.word,
            "about": row.subject_kind,
            "subject": Subject(row.subject_kind, row.subject, row.run, row.repetition).text,
            "author": row.author,
            "when": row.tagged_at.isoformat(timespec="seconds"),
        }
        for row in session.scalars(rows)
    ]
