"""Every write carries the token of its session: as the field `csrf` of a form, or the header
X-CSRF-Token."""

from __future__ import annotations

import hmac

from fastapi import APIRouter, HTTPException
from starlette.datastructures import FormData
from starlette.requests import Request

from .dependencies import writable
from .guard import SAFE_METHODS

HEADER, FIELD = "X-CSRF-Token", "csrf"
#: Of one form: the table of a campaign of hundreds of runs has a control for each cell.
MOST_FILES, MOST_FIELDS = 20_000, 50_000
_FORMS = ("application/x-www-form-urlencoded", "multipart/form-data")


async def require_csrf(request: Request) -> None:
    """Raises 403 for a write without the token; a dependency of every route."""
    if request.method in SAFE_METHODS:
        return
    given = request.headers.get(HEADER)
    if given is None and request.headers.get("content-type", "").startswith(_FORMS):
        form: FormData = await request.form(max_files=MOST_FILES, max_fields=MOST_FIELDS)
        field = form.get(FIELD)
        given = field if isinstance(field, str) else None
        if not _is_right(request, given):
            await form.close()
        else:
            _check_texts(form)
    if not _is_right(request, given):
        raise HTTPException(
            403, f"no valid token: reload the page; scripts get one from /api/csrf for {HEADER}"
        )


def _check_texts(form: FormData) -> None:
    for name, value in form.multi_items():
        if isinstance(value, str):
            try:
                writable(value)
            except ValueError as error:
                raise HTTPException(422, f"{name} {error}") from error


def _is_right(request: Request, given: str | None) -> bool:
    return given is not None and hmac.compare_digest(given.encode(), request.state.csrf.encode())


router = APIRouter(tags=["session"])


@router.get("/csrf")
def csrf(request: Request) -> dict[str, str]:
    """The token for the header X-CSRF-Token; it belongs to the cookie that this answer sets."""
    return {"header": HEADER, "token": request.state.csrf}
