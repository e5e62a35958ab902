"""What people write beside the rows of the store: notes, tags, and filters of lists that are saved
under a name.

They know what they are about by the names that people use, and not by keys: a note on an impact is
there again when its campaign, which was archived, is restored.
"""

from __future__ import annotations

from datetime import datetime

from sqlalchemy import CheckConstraint, ForeignKey, Index, Text, UniqueConstraint
from sqlalchemy.orm import Mapped, mapped_column

from .base import Base, HasId, WithProvenance, names_row, one_of
from .person_roles import PERSON_KINDS

CAMPAIGN, RUN, IMPACT, MODEL = SUBJECT_KINDS = ("campaign", "run", "impact", "model")
#: In place of a number that a subject does not have, so that a unique key holds.
NO_NUMBER = -1


class AboutSubject:
    """What a row is about: a campaign or a version of a model by its name, a run by its plan and
    its number, an impact by its campaign, its run and its repetition."""

    subject_kind: Mapped[str]
    subject: Mapped[str] = mapped_column(info=names_row("subject"))
    run: Mapped[int] = mapped_column(default=NO_NUMBER)
    repetition: Mapped[int] = mapped_column(default=NO_NUMBER)


class ByPerson:
    """Who wrote a row, and how that person is known."""

    author: Mapped[str]
    author_kind: Mapped[str]


def _subject_rule() -> CheckConstraint:
    return CheckConstraint(one_of("subject_kind", SUBJECT_KINDS), "subject_kind_known")


def _author_rule() -> CheckConstraint:
    return CheckConstraint(one_of("author_kind", PERSON_KINDS), "author_kind_known")


_SUBJECT = ("subject_kind", "subject", "run", "repetition")


class Note(HasId, WithProvenance, AboutSubject, ByPerson, Base):
    """A text of a person, as it was first written, or a later version of it.

    Rows are added and never changed: a version names the first one, and one with a `reason` in
    place of a text withdraws the note.
    """

    __tablename__ = "notes"
    __table_args__ = (
        _subject_rule(),
        _author_rule(),
        CheckConstraint("(text IS NULL) = (reason IS NOT NULL)", "text_or_reason"),
        CheckConstraint("reason IS NULL OR first_id IS NOT NULL", "withdrawn_is_later"),
        # "what is noted on this": every page of a subject
        Index("ix_notes_subject", *_SUBJECT),
    )

    first_id: Mapped[int | None] = mapped_column(ForeignKey("notes.id"), index=True)
    text: Mapped[str | None] = mapped_column(Text)
    reason: Mapped[str | None] = mapped_column(Text)
    written_at: Mapped[datetime]


class Tag(HasId, WithProvenance, AboutSubject, ByPerson, Base):
    """A short word that a person has put on something, by which lists are filtered."""

    __tablename__ = "tags"
    __table_args__ = (
        _subject_rule(),
        _author_rule(),
        CheckConstraint("length(word) BETWEEN 1 AND 40", "word_length"),
        UniqueConstraint(*_SUBJECT, "word"),
        # "what has this tag": a filter of a list
        Index("ix_tags_subject_kind_word", "subject_kind", "word"),
    )

    word: Mapped[str]
    tagged_at: Mapped[datetime]


class SavedFilter(HasId, WithProvenance, ByPerson, Base):
    """The address of a list with its filter, under a name that the laboratory shares."""

    __tablename__ = "saved_filters"
    __table_args__ = (_author_rule(),)

    name: Mapped[str] = mapped_column(unique=True, info=names_row("filter"))
    page: Mapped[str]  # the path of the list, such as /impacts
    filter: Mapped[str] = mapped_column(Text)  # what follows the question mark
    saved_at: Mapped[datetime]
