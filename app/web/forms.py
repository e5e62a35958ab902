"""What a form of a page gets back: where to go on, or what is wrong with which of its fields.

`forms.js` sends forms with the header X-Pyroshock-Form and shows the faults beside their fields;
without JavaScript the same errors are a page of their own.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from starlette.requests import Request
from starlette.responses import JSONResponse, Response

from ...schema.conditions import ConditionError

HEADER = "x-pyroshock-form"


def is_form(request: Request) -> bool:
    """Whether the page's own script sent it, which reads JSON."""
    return HEADER in request.headers


def status_of_fault(error: Exception) -> int:
    """What a page with a form answers that was filled in wrongly: 400 for a filter that cannot be
    read, else 422."""
    return 400 if isinstance(error, ConditionError) else 422


def field_of(error: Exception) -> str:
    """The field that an error is about, empty where it names none."""
    return getattr(error, "field", "") or ""


def faults_of(errors: Sequence[Any]) -> list[dict[str, str]]:
    """Field and message of each error of a validation by pydantic."""
    faults = []
    for error in errors:
        names = [str(name) for name in error["loc"] if name not in ("body", "query", "path")]
        value = f" (was {error['input']!r:.80})" if error.get("input") not in (None, "") else ""
        faults.append({"field": names[-1] if names else "", "message": f"{error['msg']}{value}"})
    return faults


def where_next(response: Response) -> Response:
    """A redirection as the address that the page's script goes on to."""
    return JSONResponse({"location": response.headers["location"]})
