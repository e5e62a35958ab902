"""Notes of people on campaigns, runs, impacts and models: written, changed, withdrawn, listed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field

from ....schema.person_roles import OPERATOR
from ..fields import Presentation, request_field, row_limit
from ..laboratory import Laboratory
from ..operation import FormPage, Operation, Outcome, Progress, Request, Rows
from .subjects import SubjectKind, find_subject, kind_field, subject_field

if TYPE_CHECKING:
    from sqlalchemy.orm import Session

    from .stored_notes import StoredNote

_USUAL, _MOST = 50, 500
_IN_A_NOTEBOOK = {"python": "A library's user reads notes with the method `query` of a store."}
_Number = Annotated[int, Field(ge=1, le=2**31 - 1)]
_TEXT = "Write the note, in plain text."


class NewNote(Request):
    """A note."""

    about: SubjectKind = kind_field()
    subject: str = subject_field()
    text: str = request_field(
        min_length=1, max_length=20_000, help=_TEXT, presentation=Presentation(lines=4)
    )


def _outcome(note: StoredNote, page: str, what: str) -> Outcome:
    line = f"note {note.key} on {note.subject.kind} {note.subject.text}: {what}"
    return Outcome((line,), note.to_json(), page or "/notes")


def _add(request: NewNote, laboratory: Laboratory, _: Progress) -> Outcome:
    from .stored_notes import add_note, get_note

    def add(session: Session) -> Outcome:
        subject = find_subject(session, request.about, request.subject)
        note = get_note(session, add_note(session, subject, request.text, laboratory.person))
        return _outcome(note, subject.page(session), "written")

    return laboratory.store.write(add)


NOTE_ADD: Operation[NewNote, Outcome] = Operation(
    name="note-add",
    request=NewNote,
    run=_add,
    help="""Write a note on a campaign, a run of a plan, an impact or a model. It keeps your name
and the time, and is shown on the page of what it is about.

A note on a run is its remark on the run sheet.""",
    example='pyroshock notes add campaign rehearsal --text "the plate was retightened on day 2"\n'
    'pyroshock notes add run rehearsal/3 --text "the tip had a scratch"',
    command=("notes", "add"),
    route=("POST", "/notes"),
    role=OPERATOR,
    label=lambda request: f"{request.about} {request.subject}",
    absent=_IN_A_NOTEBOOK,
    form=FormPage("/notes", "note-add", "/notes"),
)


class NoteEdit(Request):
    """Another text of a note."""

    note: _Number = request_field(
        help="Give the number of the note.", presentation=Presentation(positional=True)
    )
    text: str = request_field(
        min_length=1, max_length=20_000, help=_TEXT, presentation=Presentation(lines=4)
    )


def _edit(request: NoteEdit, laboratory: Laboratory, _: Progress) -> Outcome:
    from .stored_notes import change_note

    def edit(session: Session) -> Outcome:
        note = change_note(session, request.note, laboratory.person, text=request.text)
        return _outcome(note, note.subject.page(session), "changed; the earlier text stays")

    return laboratory.store.write(edit)


NOTE_EDIT: Operation[NoteEdit, Outcome] = Operation(
    name="note-edit",
    request=NoteEdit,
    run=_edit,
    help="Change the text of a note of your own. The earlier text stays with it.",
    example='pyroshock notes edit 1 --text "the plate was retightened on day 3"',
    command=("notes", "edit"),
    route=("POST", "/notes/{note}"),
    role=OPERATOR,
    absent=_IN_A_NOTEBOOK,
    form=FormPage("/notes", "note-edit", "/notes/{note}"),
)


class NoteWithdrawal(Request):
    """A note that holds no longer."""

    note: _Number = request_field(
        help="Give the number of the note.", presentation=Presentation(positional=True)
    )
    reason: str = request_field(
        min_length=1, max_length=2000, help="Say why; the reason stays with the note."
    )


def _withdraw(request: NoteWithdrawal, laboratory: Laboratory, _: Progress) -> Outcome:
    from .stored_notes import change_note

    def withdraw(session: Session) -> Outcome:
        note = change_note(session, request.note, laboratory.person, reason=request.reason)
        return _outcome(note, note.subject.page(session), "withdrawn")

    return laboratory.store.write(withdraw)


NOTE_WITHDRAW: Operation[NoteWithdrawal, Outcome] = Operation(
    name="note-withdraw",
    request=NoteWithdrawal,
    run=_withdraw,
    help="Withdraw a note of your own, with a reason; an administrator may withdraw any. Its text "
    "stays in the store.",
    example='pyroshock notes withdraw 1 --reason "it was another plate"',
    command=("notes", "withdraw"),
    route=("POST", "/notes/{note}/withdraw"),
    role=OPERATOR,
    absent=_IN_A_NOTEBOOK,
    form=FormPage("/notes", "note-withdraw", "/notes/{note}/withdraw"),
)


class NoteQuestion(Request):
    """Which notes are listed."""

    about: SubjectKind | None = request_field(
        None, help="List those on this kind of thing: campaign, run, impact or model."
    )
    subject: str | None = request_field(
        None, max_length=1000, help="List those on this one, named as `notes add` takes it."
    )
    limit: row_limit(_USUAL, _MOST) = request_field(  # type: ignore[valid-type]
        None,
        validate_default=True,
        help="List at most this number of notes, the newest first. [default: 50]",
        presentation=Presentation(option="last"),
    )
    before: _Number | None = request_field(
        None, help="List the notes older than the one with this number."
    )


class NoteRows(Rows):
    """Notes, the newest first, with their earlier versions."""

    def shortened(self, row: Mapping[str, Any]) -> dict[str, Any]:
        """The last text on one line."""
        text = row["text"] if row["text"] is not None else f"withdrawn: {row['reason']}"
        return {
            "note": row["note"],
            "about": row["about"],
            "subject": row["subject"],
            "author": row["author"],
            "written_at": row["written_at"],
            "text": " ".join(text.split()),
        }


def _list(request: NoteQuestion, laboratory: Laboratory, _: Progress) -> NoteRows:
    from .stored_notes import notes_on, recent_notes

    limit = request.limit or _USUAL
    with laboratory.store.reading() as session:
        if request.about is not None and request.subject is not None:
            subject = find_subject(session, request.about, request.subject)
            notes = notes_on(session, subject)[::-1][:limit]
        else:
            notes = recent_notes(session, limit, request.before)
    listed_notes = [note for note in notes if request.about in (None, note.subject.kind)]
    return NoteRows([note.to_json() for note in listed_notes], "no notes yet")


NOTE_LIST: Operation[NoteQuestion, NoteRows] = Operation(
    name="note-list",
    request=NoteQuestion,
    run=_list,
    help="List notes, the newest first: on anything, or on one campaign, run, impact or model.",
    example="pyroshock notes list --about campaign --subject rehearsal",
    command=("notes", "list"),
    route=("GET", "/notes"),
    listing=True,
    absent={"form": "The page /notes shows the list.", **_IN_A_NOTEBOOK},
)
