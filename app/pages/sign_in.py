"""Signing in as a user or with the server's token, and out again: this browser, or every device."""

from __future__ import annotations

import re
from typing import Annotated

from anyio import CapacityLimiter, to_thread
from fastapi import APIRouter, Depends, Form
from starlette.requests import Request
from starlette.responses import RedirectResponse, Response

from ...schema.person_roles import READER
from ..web.dependencies import Asker
from ..web.rendering import page
from ..web.role_needs import NeedsRole
from ..web.sign_in import SIGN_IN, SignIn, SignInError, new_identifier, session_cookie, session_of

router = APIRouter()
_ANYBODY = NeedsRole(READER, "signing in and out")
#: Passwords that are looked at at once: each takes 64 MiB.
_AT_ONCE = 2
#: An address of this server: browsers take `//`, `/\\` and blanks within them for the name of
#: another.
_OWN_ADDRESS = re.compile(r"/(?![/\\])[^\x00-\x20\\]*")


def own_address(address: str) -> str:
    """The address where it is one of this server, else that of its first page."""
    return address if _OWN_ADDRESS.fullmatch(address) else "/"


def _sign_in(request: Request) -> SignIn:
    entry: SignIn = request.app.state.sign_in
    return entry


@router.get(SIGN_IN)
async def form(request: Request) -> Response:
    error, address = getattr(request.state, "refused", (None, "/"))
    return _form(request, address, error)


@router.post(SIGN_IN, dependencies=[Depends(_ANYBODY)])
async def sign_in(
    request: Request,
    token: Annotated[str, Form(max_length=1000)] = "",
    name: Annotated[str, Form(max_length=1000)] = "",
    password: Annotated[str, Form(max_length=4000)] = "",
    address: Annotated[str, Form(max_length=2000)] = "/",
) -> Response:
    """Opens a session under a new identifier, for who has the token or is a user."""
    entry = _sign_in(request)
    try:
        if name:
            # A password takes 64 MiB and some 50 ms to be looked at.
            identifier = await to_thread.run_sync(
                entry.new_session_of, request, name.strip(), password, limiter=_limiter(request)
            )
        else:
            identifier = entry.new_session(request, token)
    except SignInError as error:
        return _form(request, address, error)
    return _redirect(request, own_address(address), identifier)


def _limiter(request: Request) -> CapacityLimiter:
    """Of passwords that are looked at at once, in one process."""
    limiter: CapacityLimiter | None = getattr(request.app.state, "password_limiter", None)
    if limiter is None:
        limiter = request.app.state.password_limiter = CapacityLimiter(_AT_ONCE)
    return limiter


@router.post("/sign-out", dependencies=[Depends(_ANYBODY)])
async def sign_out(request: Request) -> Response:
    """Ends the session of this browser."""
    _sign_in(request).sessions.end(session_of(request) or "")
    return _redirect(request, SIGN_IN, new_identifier())


@router.post("/sign-out/all", dependencies=[Depends(_ANYBODY)])
async def sign_out_everywhere(request: Request, person: Asker) -> Response:
    """Ends every session of this person; of the server's token, every session of this server."""
    _sign_in(request).end_sessions_of(person)
    return _redirect(request, SIGN_IN, new_identifier())


def _form(request: Request, address: str, error: SignInError | None) -> Response:
    answer = page(
        request,
        "sign_in.html",
        200 if error is None else error.status,
        address=own_address(address),
        fault="" if error is None else str(error),
        needed=_sign_in(request).needed,
        has_token=_sign_in(request).has_token,
    )
    if error is not None:
        answer.headers.update(error.headers)
    return answer


def _redirect(request: Request, address: str, identifier: str) -> Response:
    answer = RedirectResponse(address, 303)
    answer.headers.append("set-cookie", session_cookie(request, identifier))
    return answer
