"""Notes, tags and saved filters of the laboratory on one page."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Depends, Query
from starlette.requests import Request
from starlette.responses import Response

from ..operations.faults import read
from ..operations.form import controls
from ..operations.operation import Request as OperationRequest
from ..operations.people.saved_filters import FILTER_LIST, FILTER_SAVE
from ..operations.people.stored_notes import recent_notes, tag_rows
from ..operations.people.tags import TagQuestion
from ..web.dependencies import InLaboratory
from ..web.page_sources import THE_STORE
from ..web.rendering import page

router = APIRouter()
#: Notes of one page.
PAGE = 50
_Before = Annotated[int | None, Query(ge=1, le=2**31 - 1)]


@router.get("/notes", dependencies=[Depends(THE_STORE)])
def notes(
    request: Request,
    laboratory: InLaboratory,
    tag: Annotated[str, Query(max_length=40)] = "",
    before: _Before = None,
) -> Response:
    chosen = read(TagQuestion, {"tag": tag or None}, "network").tag
    filters = FILTER_LIST.answer(
        read(OperationRequest, {}, "network"), laboratory, lambda *_: None
    ).rows
    with laboratory.store.reading() as session:
        tagged = [] if chosen is None else tag_rows(session, word=chosen)
        listed = recent_notes(session, PAGE + 1, before)
        pages = {note.key: note.subject.page(session) for note in listed}
        return page(
            request,
            "notes.html",
            tag=chosen,
            tagged=tagged,
            tags=tag_rows(session),
            filters=filters,
            controls=controls(FILTER_SAVE),
            notes=listed[:PAGE],
            pages=pages,
            older=f"/notes?before={listed[PAGE - 1].key}" if len(listed) > PAGE else "",
        )
