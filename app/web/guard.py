"""What every request passes before anything reads it: the name it was sent to, who sends it, how
much it brings.

A page of elsewhere that a browser shows may send requests to this server, too. Hence the name of
the host is checked (a foreign name that was bound to 127.0.0.1), and every write carries a token
that only our own pages and `/api/csrf` tell (OWASP, cross-site request forgery prevention, signed
double submit).
"""

from __future__ import annotations

import hashlib
import hmac
import secrets
from urllib.parse import parse_qsl, unquote, urlencode, urlsplit

from anyio import CapacityLimiter, to_thread
from starlette.requests import Request
from starlette.responses import JSONResponse, PlainTextResponse, RedirectResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from ...schema.person_roles import Person
from ..operations.people.attachments import MOST_BYTES
from .forms import is_form
from .settings import Settings, is_loopback
from .sign_in import (
    OPEN_PAGES,
    SESSION,
    SIGN_IN,
    SignIn,
    SignInError,
    new_identifier,
    session_cookie,
    session_of,
)
from .sign_in_record import NOBODY

#: Stands within a path for a slash that belongs to a name; a private character of Unicode.
INNER_SLASH = "\ue02f"
SAFE_METHODS = frozenset({"GET", "HEAD", "OPTIONS"})
#: These take a campaign's files.
UPLOADS = ("/ingest", "/api/ingest")
#: A file that is attached: in a form as it is, in JSON as base64, with the other fields beside it.
ATTACHMENTS = {
    "/attachments": MOST_BYTES + 50_000,
    "/api/attachments": 4 * (MOST_BYTES // 3 + 1) + 50_000,
}
_HEADERS = {
    # No address but this server's, whatever a page is made to hold. Styles within elements are the
    # widths of bars in tables; data: and blob: are pictures that a page makes itself.
    "content-security-policy": "default-src 'none'; script-src 'self'; style-src 'self' "
    "'unsafe-inline'; img-src 'self' data: blob:; font-src 'self'; connect-src 'self'; form-action "
    "'self'; frame-ancestors 'none'; base-uri 'none'",
    "x-content-type-options": "nosniff",
    "x-frame-options": "DENY",
    "referrer-policy": "same-origin",
    "cross-origin-opener-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
}


class Guard:
    """The application behind its checks (ASGI). A refused request never reaches it."""

    def __init__(self, app: ASGIApp, settings: Settings, sign_in: SignIn) -> None:
        self.app, self.settings, self.sign_in = app, settings, sign_in
        self._key = secrets.token_bytes(32)
        #: People are looked up beside the pages that are being made, and do not wait for them.
        self._asking = CapacityLimiter(4)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "lifespan":
            await self.app(scope, receive, send)
            return
        if scope["type"] != "http":  # no page of ours opens a socket
            await send({"type": "websocket.close", "code": 1008})
            return
        request = Request(scope)
        session = session_of(request) or new_identifier()
        scope.setdefault("state", {})["csrf"] = self.csrf(session)
        answer = self._headed(send, request, session)
        refused = self._refusal(request) or await self._admission(request)
        refused = refused or self._too_long(request)
        if refused is not None:
            await refused(scope, receive, answer)
            return
        # A slash within a name: the path is decoded before it is matched.
        raw = scope.get("raw_path") or scope["path"].encode()
        scope["path"] = unquote(
            raw.decode("latin-1").replace("%2F", INNER_SLASH).replace("%2f", INNER_SLASH)
        )
        await self._limited(scope, receive, answer, self._limit(scope["path"]))

    def csrf(self, session: str) -> str:
        """The token that writes of a session carry."""
        return hmac.new(self._key, session.encode(), hashlib.sha256).hexdigest()

    def _refusal(self, request: Request) -> Response | None:
        host = request.headers.get("host", "")
        if not self._is_our_name(host):
            return refusal(
                request, 421, f"this is not {host!r}; open the address that pyroshock serve printed"
            )
        if b"%00" in request.scope.get("raw_path", b"") or b"%00" in request.scope["query_string"]:
            return refusal(
                request, 400, "the address has the character %00, which is in no name; leave it out"
            )
        origin = request.headers.get("origin")
        if (
            request.method not in SAFE_METHODS
            and origin is not None
            and origin.partition("://")[2] != host
        ):
            return refusal(request, 403, f"a page of {origin} may not write here")
        return None

    def _too_long(self, request: Request) -> Response | None:
        length = request.headers.get("content-length", "0")
        if not length.isdecimal():
            return refusal(request, 400, f"a content length of {length!r} is none")
        if int(length) > self._limit(request.url.path):
            return refusal(request, 413, self._too_large(request.url.path))
        return None

    def _is_our_name(self, host: str) -> bool:
        try:
            name = urlsplit(f"//{host}").hostname
        except ValueError:
            name = None
        if name is None:
            return False
        # Beyond loopback the server cannot know by which names the network calls it; there the
        # token guards.
        if is_loopback(name) or not is_loopback(self.settings.host):
            return True
        return name == self.settings.public_name

    async def _admission(self, request: Request) -> Response | None:
        """None for who may pass. `?token=` opens a session and leaves the address; a browser gets
        the sign-in page."""
        path = request.url.path
        request.scope["state"]["person"] = NOBODY
        try:
            query = parse_qsl(request.url.query, keep_blank_values=True)
            token = next((value for name, value in query if name == "token"), None)
            if self.sign_in.has_token and token is not None and request.method in SAFE_METHODS:
                rest = urlencode([(name, value) for name, value in query if name != "token"])
                # A path of two slashes would name another host.
                answer = RedirectResponse(
                    "/" + path.lstrip("/") + (f"?{rest}" if rest else ""), 303
                )
                identifier = await to_thread.run_sync(
                    self.sign_in.new_session, request, token, limiter=self._asking
                )
                answer.headers.append("set-cookie", session_cookie(request, identifier))
                return answer
            # Letter for letter: what is decoded afterwards is another address.
            if path not in OPEN_PAGES or b"%" in request.scope.get("raw_path", b""):
                request.scope["state"]["person"] = await self._person_of(request)
        except SignInError as error:
            if request.method == "GET" and "text/html" in request.headers.get("accept", ""):
                request.scope["state"]["refused"] = (error, self._without_token(request))
                request.scope["path"], request.scope["raw_path"] = SIGN_IN, SIGN_IN.encode()
                return None
            return refusal(request, error.status, str(error), error.headers)
        return None

    async def _person_of(self, request: Request) -> Person:
        """Who sends it; the store is asked beside the requests that go on meanwhile."""
        if self.sign_in.asks_store(request):
            return await to_thread.run_sync(self.sign_in.person_of, request, limiter=self._asking)
        return self.sign_in.person_of(request)

    @staticmethod
    def _without_token(request: Request) -> str:
        query = [
            pair
            for pair in parse_qsl(request.url.query, keep_blank_values=True)
            if pair[0] != "token"
        ]
        return request.url.path + (f"?{urlencode(query)}" if query else "")

    def _limit(self, path: str) -> int:
        if path in ATTACHMENTS:
            return ATTACHMENTS[path]
        return (
            self.settings.max_upload_bytes
            if path.startswith(UPLOADS)
            else self.settings.max_body_bytes
        )

    def _too_large(self, path: str) -> str:
        if path in ATTACHMENTS:
            return (
                f"the file has more than {MOST_BYTES:,} bytes, which is the most that is attached; "
                "make the picture smaller, or divide the document"
            )
        return f"more than {self._limit(path):,} bytes; larger campaigns: pyroshock ingest FOLDER"

    async def _limited(self, scope: Scope, receive: Receive, send: Send, limit: int) -> None:
        """Bodies are counted as they come: a length that a client declares may be missing."""
        taken, begun, over = 0, False, False

        async def counted() -> Message:
            nonlocal taken, over
            message = await receive()
            taken += len(message.get("body", b""))
            over = over or taken > limit
            return {"type": "http.disconnect"} if over else message

        async def noted(message: Message) -> None:
            nonlocal begun
            if (
                not over or begun
            ):  # what the application says of a body that breaks off is not the reason
                begun = True
                await send(message)

        try:
            await self.app(scope, counted, noted)
        except (
            Exception
        ):  # of a body that was too large the refusal below is the answer, all else is raised
            if not over:
                raise
        if over and not begun:
            await refusal(Request(scope), 413, self._too_large(scope["path"]))(scope, receive, send)

    @staticmethod
    def _headed(send: Send, request: Request, session: str) -> Send:
        has_session = session_of(request) is not None

        async def headed(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = message.setdefault("headers", [])
                present = {name.lower() for name, _ in headers}
                opens_session = any(
                    name.lower() == b"set-cookie" and value.startswith(f"{SESSION}=".encode())
                    for name, value in headers
                )
                added = (
                    _HEADERS
                    if request.url.path.startswith("/static")
                    else {**_HEADERS, "cache-control": "no-store"}
                )
                headers += [
                    (n.encode(), v.encode()) for n, v in added.items() if n.encode() not in present
                ]
                if not has_session and not opens_session:
                    headers.append((b"set-cookie", session_cookie(request, session).encode()))
            await send(message)

        return headed


def refusal(
    request: Request, status: int, why: str, headers: dict[str, str] | None = None
) -> Response:
    """Why not, as JSON for the API and as text for a person."""
    if request.url.path.startswith("/api") or is_form(request):
        return JSONResponse({"detail": why}, status, headers)
    return PlainTextResponse(f"pyroshock: {why}\n", status, headers)
