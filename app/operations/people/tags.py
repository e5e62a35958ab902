"""Tags: short words on campaigns, runs, impacts and models, by which lists are filtered."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated

from pydantic import AfterValidator

from ....schema.person_roles import OPERATOR
from ..fields import Presentation, request_field
from ..laboratory import Laboratory
from ..operation import FormPage, Operation, Outcome, Progress, Request, Rows
from .subjects import Subject, SubjectKind, find_subject, kind_field, subject_field

if TYPE_CHECKING:
    from sqlalchemy.orm import Session

_WORD = re.compile(r"[^\W_](?:[\w.-]*[^\W_])?")
_IN_A_NOTEBOOK = {"python": "A library's user reads tags with the method `query` of a store."}


def _tag_word(word: str) -> str:
    """One word in small letters."""
    word = word.casefold()
    if len(word) > 40 or not _WORD.fullmatch(word):
        raise ValueError(
            f"tag is {word[:60]!r}; expected one word of at most 40 letters and digits, with . _ - "
            "between them"
        )
    return word


TagWord = Annotated[str, AfterValidator(_tag_word)]


class NewTag(Request):
    """A tag on something."""

    about: SubjectKind = kind_field()
    subject: str = subject_field()
    tag: TagWord = request_field(
        help="Give the tag: one word, such as doubtful.", presentation=Presentation(positional=True)
    )


def _change(
    request: NewTag, laboratory: Laboratory, change: Callable[[Session, Subject], None]
) -> Outcome:
    def changed(session: Session) -> Outcome:
        from .stored_notes import tags_on

        subject = find_subject(session, request.about, request.subject)
        change(session, subject)
        session.flush()
        tags = tags_on(session, subject)
        line = f"{subject.kind} {subject.text} has the tags {', '.join(tags) or 'none'}"
        data = {"about": subject.kind, "subject": subject.text, "tags": tags}
        return Outcome((line,), data, subject.page(session) or "/notes")

    return laboratory.store.write(changed)


def _add(request: NewTag, laboratory: Laboratory, _: Progress) -> Outcome:
    from .stored_notes import add_tag

    return _change(
        request,
        laboratory,
        lambda session, subject: add_tag(session, subject, request.tag, laboratory.person),
    )


TAG_ADD: Operation[NewTag, Outcome] = Operation(
    name="tag-add",
    request=NewTag,
    run=_add,
    help="Put a tag on a campaign, a run of a plan, an impact or a model. Lists filter by it.",
    example="pyroshock tags add impact 1 doubtful",
    command=("tags", "add"),
    route=("POST", "/tags"),
    role=OPERATOR,
    label=lambda request: f"{request.about} {request.subject}",
    absent=_IN_A_NOTEBOOK,
    form=FormPage("/notes", "tag-add", "/tags"),
)


def _remove(request: NewTag, laboratory: Laboratory, _: Progress) -> Outcome:
    from .stored_notes import remove_tag

    return _change(
        request, laboratory, lambda session, subject: remove_tag(session, subject, request.tag)
    )


TAG_REMOVE: Operation[NewTag, Outcome] = Operation(
    name="tag-remove",
    request=NewTag,
    run=_remove,
    help="Take a tag off a campaign, a run of a plan, an impact or a model.",
    example="pyroshock tags add impact 1 doubtful\npyroshock tags remove impact 1 doubtful",
    command=("tags", "remove"),
    route=("POST", "/tags/remove"),
    role=OPERATOR,
    label=lambda request: f"{request.about} {request.subject}",
    absent=_IN_A_NOTEBOOK,
    form=FormPage("/notes", "tag-remove", "/tags/remove"),
)


class TagQuestion(Request):
    """Which tags are listed."""

    tag: TagWord | None = request_field(None, help="List what has this tag.")
    about: SubjectKind | None = request_field(
        None, help="List tags of this kind of thing: campaign, run, impact or model."
    )


def _list(request: TagQuestion, laboratory: Laboratory, _: Progress) -> Rows:
    from .stored_notes import tag_rows

    with laboratory.store.reading() as session:
        rows = tag_rows(session, request.about, request.tag)
    return Rows(rows, "no tags" if request.tag is None else f"nothing has the tag {request.tag}")


TAG_LIST: Operation[TagQuestion, Rows] = Operation(
    name="tag-list",
    request=TagQuestion,
    run=_list,
    help="List the tags with the number of things that have each, or what has one tag.",
    example="pyroshock tags list --tag doubtful",
    command=("tags", "list"),
    route=("GET", "/tags"),
    listing=True,
    absent={"form": "The page /notes shows the list.", **_IN_A_NOTEBOOK},
)
