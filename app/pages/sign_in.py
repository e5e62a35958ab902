"""Signing in as a user, with the server's token or through the laboratory's identity provider, and
out again: this browser, or every device."""

from __future__ import annotations

import re
from typing import Annotated
from urllib.parse import urlencode, urlsplit

from anyio import CapacityLimiter, to_thread
from fastapi import APIRouter, Depends, Form
from starlette.requests import Request
from starlette.responses import RedirectResponse, Response

from ...schema.engine import StoreRoleError
from ...schema.person_roles import READER
from ..web.dependencies import Asker
from ..web.rendering import page
from ..web.role_needs import NeedsRole
from ..web.sign_in import SIGN_IN, SignIn, SignInError, new_identifier, session_cookie
from ..web.sign_on.provider import ProviderError
from ..web.sign_on.settings import BEGIN, RETURN
from ..web.sign_on.sign_on import COOKIE

router = APIRouter()
_ANYBODY = NeedsRole(READER, "signing in and out")
#: Passwords that are looked at at once: each takes 64 MiB.
_AT_ONCE = 2
#: Sign-ins that wait for the identity provider at once.
_PROVIDER_AT_ONCE = 8
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
            identifier = await to_thread.run_sync(entry.new_session, request, token)
    except SignInError as error:
        return _form(request, address, error)
    return _redirect(request, own_address(address), identifier)


def _limiter(request: Request) -> CapacityLimiter:
    """Of passwords that are looked at at once, in one process."""
    limiter: CapacityLimiter | None = getattr(request.app.state, "password_limiter", None)
    if limiter is None:
        limiter = request.app.state.password_limiter = CapacityLimiter(_AT_ONCE)
    return limiter


@router.get(BEGIN)
async def begin_at_provider(request: Request, address: str = "/", here: bool = False) -> Response:
    """Leads to the identity provider, from the public address of this server: the cookie that the
    browser keeps meanwhile belongs to that one."""
    sign_on = _sign_in(request).sign_on
    if sign_on is None:
        return RedirectResponse(SIGN_IN, 303)
    address = own_address(address)
    public = urlsplit(sign_on.settings.origin).netloc
    if request.headers.get("host", "") != public and not here:
        words = urlencode({"address": address, "here": "true"})
        return RedirectResponse(f"{sign_on.settings.origin}{BEGIN}?{words}", 303)
    try:
        begun = await to_thread.run_sync(sign_on.begin, address, limiter=_provider_limiter(request))
    except ProviderError as error:
        return _form(request, address, SignInError(503, str(error)))
    answer = RedirectResponse(begun.address, 303)
    answer.headers.append("set-cookie", sign_on.cookie_header(begun.cookie))
    return answer


@router.get(RETURN)
async def return_from_provider(request: Request) -> Response:
    """Opens a session for who has signed in at the identity provider.

    The page that was asked for is opened by a page of this server: a browser that the provider has
    sent keeps strict cookies back, those of a session, also through a redirect.
    """
    entry = _sign_in(request)
    if entry.sign_on is None:
        return RedirectResponse(SIGN_IN, 303)
    cookie = request.cookies.get(COOKIE, "")
    try:
        identifier, address = await to_thread.run_sync(
            entry.new_session_of_account,
            request,
            cookie,
            dict(request.query_params),
            limiter=_provider_limiter(request),
        )
    except SignInError as error:
        answer: Response = _form(request, "/", error)
    except StoreRoleError as error:
        answer = _form(request, "/", SignInError(403, str(error)))
    else:
        answer = page(request, "signed_in.html", address=own_address(address))
        answer.headers.append("set-cookie", session_cookie(request, identifier))
    answer.headers.append("set-cookie", entry.sign_on.cookie_header(""))
    return answer


def _provider_limiter(request: Request) -> CapacityLimiter:
    """Of sign-ins that wait for the identity provider at once: other pages go on."""
    limiter: CapacityLimiter | None = getattr(request.app.state, "provider_limiter", None)
    if limiter is None:
        limiter = request.app.state.provider_limiter = CapacityLimiter(_PROVIDER_AT_ONCE)
    return limiter


@router.post("/sign-out", dependencies=[Depends(_ANYBODY)])
def sign_out(request: Request, person: Asker) -> Response:
    """Ends the session of this browser."""
    _sign_in(request).sign_out(request, person)
    return _redirect(request, SIGN_IN, new_identifier())


@router.post("/sign-out/all", dependencies=[Depends(_ANYBODY)])
def sign_out_everywhere(request: Request, person: Asker) -> Response:
    """Ends every session of this person; of the server's token, every session of this server."""
    _sign_in(request).sign_out(request, person, everywhere=True)
    return _redirect(request, SIGN_IN, new_identifier())


def _form(request: Request, address: str, error: SignInError | None) -> Response:
    entry = _sign_in(request)
    answer = page(
        request,
        "sign_in.html",
        200 if error is None else error.status,
        address=own_address(address),
        fault="" if error is None else str(error),
        needed=entry.needed,
        has_token=entry.has_token,
        takes_passwords=entry.takes_passwords,
        provider="" if entry.sign_on is None else entry.sign_on.settings.name,
        begin=f"{BEGIN}?{urlencode({'address': own_address(address)})}",
    )
    if error is not None:
        answer.headers.update(error.headers)
    return answer


def _redirect(request: Request, address: str, identifier: str) -> Response:
    answer = RedirectResponse(address, 303)
    answer.headers.append("set-cookie", session_cookie(request, identifier))
    return answer
