"""Who may pass where the server has a token: an open session, `Authorization: Bearer TOKEN`, or a
sign-in with it."""

from __future__ import annotations

import hmac
import math
import secrets
from http.cookies import CookieError, SimpleCookie

from starlette.requests import Request

from .sessions import Sessions
from .sign_in_attempts import SignInAttempts

SESSION = "pyroshock_session"
#: The page with the form; the only one that is shown without the token.
SIGN_IN = "/sign-in"


class SignInError(ValueError):
    """Not admitted; `status` is 401, or 429 while tokens from this address are not looked at
    (`retry_after_s`)."""

    def __init__(self, status: int, message: str, retry_after_s: int | None = None) -> None:
        super().__init__(message)
        self.status, self.retry_after_s = status, retry_after_s

    @property
    def headers(self) -> dict[str, str]:
        """What HTTP says of it beside the status."""
        if self.retry_after_s is None:
            return {"www-authenticate": "Bearer"}
        return {"retry-after": str(self.retry_after_s)}


class SignIn:
    """The token of a server with the sessions that it has opened. `token` None: everybody passes,
    nobody signs in."""

    def __init__(
        self,
        token: str | None,
        sessions: Sessions | None = None,
        attempts: SignInAttempts | None = None,
    ) -> None:
        self._token = token
        self.sessions = sessions or Sessions()
        self.attempts = attempts or SignInAttempts()

    @property
    def needed(self) -> bool:
        """Whether there is a token to know."""
        return self._token is not None

    def check_admitted(self, request: Request) -> None:
        """Passes an open session and the right token of a script. Raises `SignInError`."""
        if self._token is None or self.sessions.is_open(session_of(request) or ""):
            return
        header = request.headers.get("authorization")
        if header is None:
            raise SignInError(
                401,
                "a token is needed: open the address that pyroshock serve "
                "printed, or send Authorization: Bearer TOKEN",
            )
        scheme, _, word = header.partition(" ")
        if scheme.lower() != "bearer":
            raise SignInError(
                401, "Authorization needs the scheme Bearer: send Authorization: Bearer TOKEN"
            )
        self._check_token(request, word.strip())

    def new_session(self, request: Request, token: str) -> str:
        """The identifier of a new session for who sends the token; the one before it ends. Raises
        `SignInError`."""
        self._check_token(request, token)
        self.sessions.end(session_of(request) or "")
        return self.sessions.begin()

    def _check_token(self, request: Request, token: str) -> None:
        host = request.client.host if request.client else None
        wait_s = math.ceil(self.attempts.wait_s(host))
        if wait_s > 0:
            raise SignInError(
                429,
                f"too many wrong tokens from {host}: the next one is looked at in {wait_s} s; "
                "sessions that are open go on",
                wait_s,
            )
        if self._token is not None and not hmac.compare_digest(
            token.encode(), self._token.encode()
        ):
            self.attempts.failed(host)
            raise SignInError(401, "this is not the server's token")
        self.attempts.succeeded(host)


def session_of(request: Request) -> str | None:
    """The identifier that the request's cookie brings, open or not."""
    try:
        cookies = SimpleCookie(request.headers.get("cookie", ""))
    except CookieError:
        return None
    return cookies[SESSION].value if SESSION in cookies else None


def new_identifier() -> str:
    """Of a visit that is not signed in: it ties the token of a form to its browser, and opens
    nothing."""
    return secrets.token_urlsafe(18)


def session_cookie(request: Request, identifier: str) -> str:
    """The header's text: no script reads the cookie, no page of elsewhere sends it, and over TLS
    only TLS does."""
    secure = "; Secure" if request.url.scheme == "https" else ""
    return f"{SESSION}={identifier}; HttpOnly; Path=/; SameSite=strict{secure}"
