"""Answers for the Python library on another machine: a result with all its fields, where a request
accepts the media type `RESULT_TYPE`."""

from __future__ import annotations

from typing import Any

from starlette.requests import Request
from starlette.responses import JSONResponse

from ... import __version__
from ..operations.result_codec import encode

#: What a client sends as `Accept`; its form may change with every version.
RESULT_TYPE = "application/vnd.pyroshock.result+json"


def wants_result(request: Request) -> bool:
    """Whether a request asks for the whole result, and not for its JSON for people's programs."""
    return RESULT_TYPE in request.headers.get("accept", "")


def result_answer(value: Any) -> JSONResponse:
    """A result, or plain data with arrays, and the version that has written it."""
    content = {"software": __version__, "result": encode(value)}
    return JSONResponse(content, media_type=RESULT_TYPE, headers={"vary": "Accept"})
