"""The answer of the box at the head of every page: what has all of the words, with links."""

from __future__ import annotations

from itertools import groupby
from typing import Annotated

from fastapi import APIRouter, Query
from starlette.requests import Request
from starlette.responses import Response

from ..operations.faults import read
from ..operations.store.search import PLURALS, SEARCH, SearchQuestion
from ..web.dependencies import InLaboratory
from ..web.rendering import page

router = APIRouter()


@router.get("/search")
def search(
    request: Request,
    laboratory: InLaboratory,
    words: Annotated[str, Query(max_length=1000)] = "",
) -> Response:
    if not words.split():
        return page(request, "search.html", words="", hits=None, groups=[], plurals=PLURALS)
    question = read(SearchQuestion, {"words": words}, "network")
    hits = SEARCH.answer(question, laboratory, lambda *_: None)
    return page(
        request,
        "search.html",
        words=words,
        hits=hits,
        groups=[(kind, list(rows)) for kind, rows in groupby(hits.rows, lambda row: row["kind"])],
        plurals=PLURALS,
    )
