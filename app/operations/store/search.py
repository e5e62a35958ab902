"""Search in everything that people name: campaigns, recordings, impacts, plans, models, datasets,
diagnoses, materials, notes, attachments, tags and saved filters."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any
from urllib.parse import quote

from pydantic import AfterValidator, Field

from ....schema.person_roles import READER
from ..fields import Presentation, request_field
from ..laboratory import Laboratory
from ..operation import Operation, Progress, Request, Rows

if TYPE_CHECKING:
    from sqlalchemy import ColumnElement
    from sqlalchemy.orm import Session

#: Hits of each kind that are listed.
USUAL, MOST = 20, 200
#: Recordings and notes are looked through from the newest back to this many: a store may hold
#: millions, and an answer comes while a person waits.
_LOOKED_THROUGH = 50_000
#: What each kind is called where there are several.
PLURALS = {
    "campaign": "campaigns",
    "recording": "recordings",
    "impact": "impacts",
    "plan": "plans",
    "model": "models",
    "dataset": "datasets",
    "diagnosis": "diagnoses",
    "material": "materials",
    "note": "notes",
    "attachment": "attachments",
    "tag": "tags",
    "filter": "saved filters",
}


def _has_words(text: str) -> str:
    if not text.split():
        raise ValueError("words is empty; expected a word or several, or the number of an impact")
    return text


class SearchQuestion(Request):
    """Words that are looked for."""

    words: Annotated[str, Field(max_length=200), AfterValidator(_has_words)] = request_field(
        help="Give words, all of which must appear, or the number of an impact or a diagnosis.",
        presentation=Presentation(positional=True),
    )
    limit: Annotated[int, Field(ge=1, le=MOST)] = request_field(
        USUAL, help="List at most this number of hits of each kind."
    )


@dataclass(frozen=True)
class FoundThings(Rows):
    """What was found, a row for each hit. `more` are kinds of which more was found than is
    listed."""

    more: tuple[str, ...] = ()

    def counts(self) -> dict[str, int]:
        """The number of listed hits of each kind."""
        kinds = [row["kind"] for row in self.rows]
        return {kind: kinds.count(kind) for kind in dict.fromkeys(kinds)}

    def count_words(self) -> str:
        """How many there are: "3 found: 2 campaigns, 1 note", with "at least" where not all are
        listed."""
        if not self.rows:
            return "Nothing was found."
        parts = [
            f"{'at least ' if kind in self.more else ''}{number} "
            f"{kind if number == 1 else PLURALS[kind]}"
            for kind, number in self.counts().items()
        ]
        begin = "At least " if self.more else ""
        return f"{begin}{len(self.rows)} found: {', '.join(parts)}."


def _search(request: SearchQuestion, laboratory: Laboratory, _: Progress) -> FoundThings:
    words, limit = request.words.split()[:10], request.limit
    rows: list[dict[str, Any]] = []
    more = []
    with laboratory.store.reading() as session:
        for kind, find in _KINDS.items():
            hits = list(find(session, words, limit + 1))
            if len(hits) > limit:
                more.append(kind)
            rows += [
                {"kind": kind, "name": name, "about": about, "address": address}
                for name, about, address in hits[:limit]
            ]
    empty = f"nothing has all of the words {' '.join(words)}"
    return FoundThings(rows, empty, tuple(more))


SEARCH: Operation[SearchQuestion, FoundThings] = Operation(
    name="search",
    request=SearchQuestion,
    run=_search,
    help="""Find campaigns, recordings, impacts, plans, models, datasets, diagnoses, materials,
notes, attachments, tags and saved filters by words.

All words must appear. Recordings and notes are looked through from the newest back to 50,000.""",
    example="pyroshock search rehearsal\npyroshock search steel",
    route=("GET", "/search"),
    role=READER,
    listing=True,
    absent={
        "form": "The box at the head of every page has it.",
        "python": "A library's user searches with the method `query` of a store.",
    },
)

# --- what is looked through; each hit is a name, what is said of it, and the address of its page

_Found = tuple[str, str, str]


def _all_words(words: Sequence[str], *columns: Any) -> Iterator[ColumnElement[bool]]:
    """Conditions: each word is within one of the columns, in capitals or not."""
    from sqlalchemy import or_

    for word in words:
        yield or_(*(column.icontains(word, autoescape=True) for column in columns))


def _number(words: Sequence[str]) -> int | None:
    """The number that is looked for, where it is nothing but one, with or without a #."""
    text = words[0].removeprefix("#")
    return int(text) if len(words) == 1 and text.isdecimal() and len(text) < 10 else None


def _part(name: str) -> str:
    return quote(name, safe="")


def _campaigns(session: Session, words: Sequence[str], limit: int) -> Iterator[_Found]:
    from sqlalchemy import select

    from ....schema.campaigns import Campaign

    columns = (Campaign.name, Campaign.description, Campaign.operator)
    query = select(Campaign).where(*_all_words(words, *columns)).order_by(Campaign.id.desc())
    for row in session.scalars(query.limit(limit)):
        yield row.name, row.description or f"a {row.kind}", f"/campaigns/{_part(row.name)}"


def _recordings(session: Session, words: Sequence[str], limit: int) -> Iterator[_Found]:
    from sqlalchemy import func, select

    from ....schema.campaigns import Campaign
    from ....schema.recordings import Recording

    newest = select(func.max(Recording.id)).scalar_subquery()
    query = (
        select(Recording.path, Recording.status, Campaign.name)
        .join(Campaign, Recording.campaign_id == Campaign.id)
        .where(Recording.id > newest - _LOOKED_THROUGH, *_all_words(words, Recording.path))
        .order_by(Recording.id.desc())
        .limit(limit)
    )
    for path, status, campaign in session.execute(query):
        yield path, f"{status}, of {campaign}", f"/campaigns/{_part(campaign)}"


def _impacts(session: Session, words: Sequence[str], _limit: int) -> Iterator[_Found]:
    from sqlalchemy import select

    from ....schema.campaigns import Campaign
    from ....schema.impacts import Impact

    number = _number(words)
    if number is None:
        return
    query = select(Campaign.name, Impact.run, Impact.repetition).join(
        Campaign, Impact.campaign_id == Campaign.id
    )
    row = session.execute(query.where(Impact.id == number)).one_or_none()
    if row is not None:
        about = f"run {row.run}, repetition {row.repetition} of {row.name}"
        yield f"impact {number}", about, f"/impacts/{number}"


def _plans(session: Session, words: Sequence[str], limit: int) -> Iterator[_Found]:
    from sqlalchemy import select

    from ....schema.campaigns import Plan

    query = select(Plan).where(*_all_words(words, Plan.name, Plan.method)).order_by(Plan.id.desc())
    for row in session.scalars(query.limit(limit)):
        yield row.name, f"{row.method} of a {row.kind}", f"/plans/{_part(row.name)}"


def _models(session: Session, words: Sequence[str], limit: int) -> Iterator[_Found]:
    from sqlalchemy import select

    from ....schema.registered_models import RegisteredVersion

    model = RegisteredVersion
    query = (
        select(model.label, model.name, model.version, model.dataset)
        .where(*_all_words(words, model.label, model.dataset))
        .order_by(model.id.desc())
    )
    for label, name, version, dataset in session.execute(query.limit(limit)):
        yield label, f"trained on {dataset}", f"/models/{_part(name)}/{version}"


def _datasets(session: Session, words: Sequence[str], limit: int) -> Iterator[_Found]:
    from sqlalchemy import select

    from ....schema.impacts import DatasetSnapshot

    query = select(DatasetSnapshot.name, DatasetSnapshot.frozen_at).where(
        *_all_words(words, DatasetSnapshot.name)
    )
    for name, frozen_at in session.execute(query.order_by(DatasetSnapshot.id.desc()).limit(limit)):
        yield name, f"frozen {frozen_at:%Y-%m-%d}", f"/datasets/{_part(name)}"


def _diagnoses(session: Session, words: Sequence[str], limit: int) -> Iterator[_Found]:
    from sqlalchemy import or_, select

    from ....schema.campaigns import Campaign
    from ....schema.diagnoses import Diagnosis

    number = _number(words)
    own = list(_all_words(words, Campaign.name, Diagnosis.simulator))
    matches = own if number is None else [or_(Diagnosis.id == number, *own)]
    query = (
        select(Diagnosis.id, Diagnosis.simulator, Diagnosis.diagnosed_at, Campaign.name)
        .join(Campaign, Diagnosis.campaign_id == Campaign.id)
        .where(*matches)
        .order_by(Diagnosis.id.desc())
    )
    for key, simulator, when, campaign in session.execute(query.limit(limit)):
        about = f"{campaign} against {simulator}, {when:%Y-%m-%d}"
        yield f"diagnosis {key}", about, f"/diagnoses/{key}"


def _materials(session: Session, words: Sequence[str], limit: int) -> Iterator[_Found]:
    from sqlalchemy import and_, or_, select

    from ....schema.benches import Material, MaterialAlias

    alias = select(MaterialAlias.material_id).where(*_all_words(words, MaterialAlias.alias))
    named = _all_words(words, Material.name, Material.source)
    query = select(Material).where(or_(and_(*named), Material.id.in_(alias)))
    for row in session.scalars(query.order_by(Material.name).limit(limit)):
        yield row.name, row.source, "/ask/material-list"


def _notes(session: Session, words: Sequence[str], limit: int) -> Iterator[_Found]:
    from sqlalchemy import func, select

    from ....schema.notes import Note
    from ..people.stored_notes import get_note

    newest = select(func.max(Note.id)).scalar_subquery()
    query = (
        select(func.coalesce(Note.first_id, Note.id))
        .where(Note.id > newest - _LOOKED_THROUGH, *_all_words(words, Note.text, Note.author))
        .distinct()
    )
    listed = 0
    for key in sorted(session.scalars(query.limit(5 * limit)), reverse=True):
        note = get_note(session, key)
        text = f"{note.last.text} {note.author}".casefold()
        # What an earlier version said, and what was withdrawn, is said no more.
        if note.last.text is None or not all(word.casefold() in text for word in words):
            continue
        listed += 1
        if listed > limit:
            return
        excerpt = " ".join(note.last.text.split())
        about = f"{note.subject.kind} {note.subject.text}, {note.author}"
        name = excerpt if len(excerpt) <= 120 else f"{excerpt[:120]}…"
        yield name, about, note.subject.page(session) or "/notes"


def _tags(session: Session, words: Sequence[str], limit: int) -> Iterator[_Found]:
    from sqlalchemy import func, select

    from ....schema.notes import Tag

    query = select(Tag.word, func.count()).where(*_all_words(words, Tag.word)).group_by(Tag.word)
    for word, number in session.execute(query.order_by(Tag.word).limit(limit)):
        things = "1 thing has it" if number == 1 else f"{number} things have it"
        yield word, things, f"/notes?tag={_part(word)}"


def _filters(session: Session, words: Sequence[str], limit: int) -> Iterator[_Found]:
    from sqlalchemy import select

    from ....schema.notes import SavedFilter

    query = select(SavedFilter).where(*_all_words(words, SavedFilter.name))
    for row in session.scalars(query.order_by(SavedFilter.name).limit(limit)):
        yield row.name, row.author, f"{row.page}?{row.filter}" if row.filter else row.page


def _attachments(session: Session, words: Sequence[str], limit: int) -> Iterator[_Found]:
    from sqlalchemy import select

    from ....schema.attachments import Attachment
    from ..people.stored_attachments import get_attachment

    row = Attachment
    query = select(row.id).where(
        row.removed_at.is_(None), *_all_words(words, row.file_name, row.caption, row.author)
    )
    for key in session.scalars(query.order_by(row.id.desc()).limit(limit)):
        attachment = get_attachment(session, key)
        subject = attachment.subject
        about = f"attached to {subject.kind} {subject.text}, {attachment.author}"
        name = " ".join((attachment.caption or attachment.file_name).split())
        yield f"{name[:120]}…" if len(name) > 120 else name, about, subject.page(session)


_Find = Callable[["Session", Sequence[str], int], Iterator[_Found]]
_KINDS: Mapping[str, _Find] = {
    "campaign": _campaigns,
    "impact": _impacts,
    "plan": _plans,
    "model": _models,
    "dataset": _datasets,
    "diagnosis": _diagnoses,
    "note": _notes,
    "attachment": _attachments,
    "tag": _tags,
    "filter": _filters,
    "material": _materials,
    "recording": _recordings,
}
