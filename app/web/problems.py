"""How the API tells what is wrong: the same form for every route, and what each status stands for."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel


class Problem(BaseModel):
    """What is wrong, the value that it is about, and what to do next."""

    detail: str


_WORDS = {
    400: "The body cannot be read",
    401: "The server's token is needed",
    403: "A write without the token of /api/csrf, or one that the role of the server's login forbids",
    404: "There is no such thing in the store",
    413: "The body is too large",
    422: "A value cannot be used",
    503: "The store or the disk fails",
}
#: For `include_router`.
PROBLEMS: dict[int | str, dict[str, Any]] = {
    status: {"model": Problem, "description": words} for status, words in _WORDS.items()
}
