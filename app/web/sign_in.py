"""Who may pass where the server has a token or asks people for their password: an open session,
`Authorization: Bearer TOKEN`, or a sign-in."""

from __future__ import annotations

import hmac
import math
import secrets
from http.cookies import CookieError, SimpleCookie

from starlette.requests import Request

from ...schema.person_roles import LOCAL_PERSON, TOKEN_PERSON, USER, Person
from ..operations.people.stored_users import TOKEN_BEGIN
from .accounts import Accounts
from .sessions import OpenSession, Sessions
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
    """Who is let in, and as which person: by the server's one token, as a user with a password, or
    by the token of a user's script. Without a token, and where `asks_people` is false, everybody
    passes as the person named "local", and nobody signs in."""

    def __init__(
        self,
        token: str | None,
        accounts: Accounts | None = None,
        *,
        asks_people: bool = False,
        sessions: Sessions | None = None,
        attempts: SignInAttempts | None = None,
    ) -> None:
        self._token, self._accounts, self._asks_people = token, accounts, asks_people
        self.sessions = sessions or Sessions()
        #: Wrong words by the address that they come from, and wrong passwords by the name.
        self.attempts = attempts or SignInAttempts()
        self.attempts_by_name = SignInAttempts()

    @property
    def needed(self) -> bool:
        """Whether there is something to know."""
        return self._token is not None or self._asks_people

    @property
    def has_token(self) -> bool:
        """Whether the server has a token of its own."""
        return self._token is not None

    def asks_store(self, request: Request) -> bool:
        """Whether the store must be asked who sends a request."""
        opened = self.sessions.find(session_of(request) or "") if self.needed else None
        if opened is not None:
            return opened.person.kind == USER
        return self.needed and f" {TOKEN_BEGIN}" in request.headers.get("authorization", "")

    def person_of(self, request: Request) -> Person:
        """Who sends a request: of an open session, or of the right token of a script. Raises
        `SignInError`."""
        if not self.needed:
            return LOCAL_PERSON
        identifier = session_of(request) or ""
        opened = self.sessions.find(identifier)
        person = None if opened is None else self._present(opened)
        if person is not None:
            return person
        if opened is not None:
            self.sessions.end(identifier)
        header = request.headers.get("authorization")
        if header is None:
            raise SignInError(
                401,
                "a sign-in or a token is needed: open the address that pyroshock serve "
                "printed, or send Authorization: Bearer TOKEN",
            )
        scheme, _, word = header.partition(" ")
        if scheme.lower() != "bearer":
            raise SignInError(
                401, "Authorization needs the scheme Bearer: send Authorization: Bearer TOKEN"
            )
        return self._person_of_token(request, word.strip())

    def new_session(self, request: Request, token: str) -> str:
        """The identifier of a new session for who sends the server's token; the one before it ends.
        Raises `SignInError`."""
        self._check_wait(request)
        self._check_token(request, token)
        self.sessions.end(session_of(request) or "")
        return self.sessions.begin()

    def new_session_of(self, request: Request, name: str, password: str) -> str:
        """The identifier of a new session of a user; the one before it ends. Raises `SignInError`,
        with the same words for an unknown name as for a wrong password."""
        self._check_wait(request)
        wait_s = math.ceil(self.attempts_by_name.wait_s(name))
        if wait_s > 0:
            raise SignInError(
                429,
                f"too many wrong passwords for this name: the next one is looked at in {wait_s} s; "
                "sessions that are open go on",
                wait_s,
            )
        person = None if self._accounts is None else self._accounts.by_password(name, password)
        if person is None:
            self.attempts.failed(_host(request))
            self.attempts_by_name.failed(name)
            raise SignInError(401, "the name or the password is wrong")
        self.attempts.succeeded(_host(request))
        self.attempts_by_name.succeeded(name)
        self.sessions.end(session_of(request) or "")
        return self.sessions.begin(*person)

    def renewed_session(self, request: Request, person: Person) -> str:
        """The identifier of the session that goes on after its user has changed the password, which
        has ended all others."""
        identifier = session_of(request) or ""
        opened = self.sessions.find(identifier)
        generation = 0 if opened is None else opened.generation
        self.sessions.end_of(person.user_id)
        return self.sessions.begin(person, generation + 1)

    def end_sessions_of(self, person: Person) -> None:
        """End the sessions of a user; for anybody else, all of this server."""
        if person.kind == USER:
            self.sessions.end_of(person.user_id)
        else:
            self.sessions.end_all()

    def _present(self, opened: OpenSession) -> Person | None:
        """The person of a session as the store knows it now; None where it has ended."""
        if opened.person.kind != USER or self._accounts is None:
            return opened.person
        return self._accounts.by_session(opened.person.user_id, opened.generation)

    def _person_of_token(self, request: Request, word: str) -> Person:
        self._check_wait(request)
        if self._accounts is not None and word.startswith(TOKEN_BEGIN):
            person = self._accounts.by_token(word)
            if person is not None:
                self.attempts.succeeded(_host(request))
                return person
        self._check_token(request, word)
        return TOKEN_PERSON

    def _check_wait(self, request: Request) -> None:
        host = _host(request)
        wait_s = math.ceil(self.attempts.wait_s(host))
        if wait_s > 0:
            raise SignInError(
                429,
                f"too many wrong tokens from {host}: the next one is looked at in {wait_s} s; "
                "sessions that are open go on",
                wait_s,
            )

    def _check_token(self, request: Request, token: str) -> None:
        if self._token is None or not hmac.compare_digest(token.encode(), self._token.encode()):
            self.attempts.failed(_host(request))
            raise SignInError(401, "this is not the server's token")
        self.attempts.succeeded(_host(request))


def _host(request: Request) -> str | None:
    return request.client.host if request.client else None


def session_of(request: Request) -> str | None:
    """The identifier that the request's cookie brings, open or not."""
    try:
        cookies = SimpleCookie(request.headers.get("cookie", ""))
    except CookieError:  # a cookie that no browser sends is no identifier
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
