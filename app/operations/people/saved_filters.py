"""Filters of lists and views of charts under a name that the whole laboratory shares."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Annotated

from pydantic import Field

from ....schema.person_roles import ADMINISTRATOR, OPERATOR, READER, RoleNeededError
from ..fields import Presentation, request_field
from ..laboratory import Laboratory
from ..operation import FormPage, Operation, Outcome, Progress, Request, Rows

if TYPE_CHECKING:
    from sqlalchemy.orm import Session

#: An address of this server: a path, and perhaps a question mark with what follows.
_ADDRESS = re.compile(r"(?P<page>/(?![/\\])[\w./@%~+-]*)(?:\?(?P<filter>[^#\s\x00-\x1f]*))?")
_IN_A_NOTEBOOK = {"python": "A filter is the address of a page, which a library does not open."}
FilterName = Annotated[str, Field(min_length=1, max_length=100)]


def _list(_: Request, laboratory: Laboratory, __: Progress) -> Rows:
    from sqlalchemy import select

    from ....schema.notes import SavedFilter

    with laboratory.store.reading() as session:
        rows = [
            {
                "name": row.name,
                "address": f"{row.page}?{row.filter}" if row.filter else row.page,
                "author": row.author,
                "when": row.saved_at.isoformat(timespec="seconds"),
            }
            for row in session.scalars(select(SavedFilter).order_by(SavedFilter.name))
        ]
    return Rows(rows, "no saved filters yet")


FILTER_LIST: Operation[Request, Rows] = Operation(
    name="filter-list",
    request=Request,
    run=_list,
    help="List the saved filters, with the address of the page that each opens.",
    example="pyroshock filters list",
    command=("filters", "list"),
    route=("GET", "/filters"),
    role=READER,
    listing=True,
    absent={"form": "The page /notes shows the list.", **_IN_A_NOTEBOOK},
)


class NewFilter(Request):
    """A filter to be saved."""

    name: FilterName = request_field(
        help="Call the filter so.", presentation=Presentation(positional=True)
    )
    address: str = request_field(
        min_length=1,
        max_length=8_000,
        help="Give the address of the page with its filter, such as /impacts?where=tag=doubtful.",
        presentation=Presentation(positional=True),
    )


def _save(request: NewFilter, laboratory: Laboratory, _: Progress) -> Outcome:
    from datetime import UTC, datetime

    from sqlalchemy import select

    from ....schema.notes import SavedFilter
    from .subjects import author_columns

    # Whoever copies the whole address of the page gives the name of the server with it.
    text = re.sub(r"^https?://[^/]+", "", request.address)
    address = _ADDRESS.fullmatch(text)
    if address is None:
        raise ValueError(
            f"address is {request.address[:200]!r}; expected one of this server, such as "
            "/impacts?where=tag=doubtful"
        )

    def save(session: Session) -> None:
        if session.scalar(select(SavedFilter.id).where(SavedFilter.name == request.name)):
            raise ValueError(
                f"a filter {request.name!r} exists already; delete it first, or choose another name"
            )
        session.add(
            SavedFilter(
                **author_columns(laboratory.person),
                name=request.name,
                page=address["page"],
                filter=address["filter"] or "",
                saved_at=datetime.now(UTC),
            )
        )

    laboratory.store.write(save)
    line = f"filter {request.name} saved"
    return Outcome((line,), {"name": request.name, "address": text}, "/notes")


FILTER_SAVE: Operation[NewFilter, Outcome] = Operation(
    name="filter-save",
    request=NewFilter,
    run=_save,
    help="Save the address of a page with its filter or its charts under a name, for everybody.",
    example='pyroshock filters save doubtful "/impacts?where=tag=doubtful"',
    command=("filters", "save"),
    route=("POST", "/filters"),
    role=OPERATOR,
    absent=_IN_A_NOTEBOOK,
    form=FormPage("/notes", "filter-save", "/filters"),
)


class NamedFilter(Request):
    """A saved filter."""

    name: FilterName = request_field(
        help="Name the filter.", presentation=Presentation(positional=True)
    )


def _deletable(request: NamedFilter, laboratory: Laboratory) -> str:
    from sqlalchemy import select

    from ....schema.notes import SavedFilter

    query = select(SavedFilter.name).where(SavedFilter.name == request.name)
    if laboratory.store.read(lambda session: session.scalar(query)) is None:
        raise LookupError(f"no filter {request.name!r} in the store; pyroshock filters lists them")
    return f"filter {request.name}"


def _delete(request: NamedFilter, laboratory: Laboratory, _: Progress) -> Outcome:
    from sqlalchemy import delete, select

    from ....schema.notes import SavedFilter

    person = laboratory.person

    def remove(session: Session) -> None:
        own = SavedFilter.name == request.name
        row = session.scalars(select(SavedFilter).where(own)).one_or_none()
        if row is None:
            raise LookupError(
                f"no filter {request.name!r} in the store; pyroshock filters lists them"
            )
        if (row.author, row.author_kind) != (person.name, person.kind) and not person.may(
            ADMINISTRATOR
        ):
            raise RoleNeededError(
                f"filter {request.name!r} is by {row.author}, who alone deletes it, or an "
                "administrator"
            )
        session.execute(delete(SavedFilter).where(own))

    laboratory.store.write(remove)
    return Outcome((f"filter {request.name} deleted",), {"name": request.name}, "/notes")


FILTER_DELETE: Operation[NamedFilter, Outcome] = Operation(
    name="filter-delete",
    request=NamedFilter,
    run=_delete,
    help="Delete a saved filter of your own; an administrator may delete any.",
    example='pyroshock filters save doubtful "/impacts?where=tag=doubtful"\n'
    "pyroshock filters delete doubtful --yes",
    command=("filters", "delete"),
    route=("POST", "/filters/{name}/delete"),
    role=OPERATOR,
    deletes=_deletable,
    absent=_IN_A_NOTEBOOK,
    form=FormPage("/notes", "filter-delete", "/filters/{name}/delete"),
)
