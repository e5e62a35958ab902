"""Who may pass where the server has a token or asks people to sign in: an open session,
`Authorization: Bearer TOKEN`, or a sign-in by password, token or identity provider."""

from __future__ import annotations

import hmac
import math
import secrets
from collections.abc import Mapping
from http.cookies import CookieError, SimpleCookie

from starlette.requests import Request

from ...schema.person_roles import LOCAL_PERSON, TOKEN_PERSON, USER, Person
from ..operations.people.stored_identities import NotAdmittedError
from ..operations.people.stored_users import TOKEN_BEGIN
from .accounts import PROVIDER_WAY, Accounts
from .sessions import OpenSession, Sessions
from .sign_in_attempts import SignInAttempts
from .sign_in_record import SignInRecord
from .sign_on.provider import ProviderError
from .sign_on.settings import BEGIN, RETURN
from .sign_on.sign_on import SignOn

SESSION = "pyroshock_session"
#: The page with the form; the only one that is shown without the token.
SIGN_IN = "/sign-in"
#: Shown to who is not signed in.
OPEN_PAGES = frozenset({SIGN_IN, BEGIN, RETURN})


class SignInError(ValueError):
    """Not admitted; `status` is 401, 403 for who is known and no user here, or 429 while tokens
    from this address are not looked at (`retry_after_s`)."""

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
        takes_passwords: bool = True,
        sign_on: SignOn | None = None,
        record: SignInRecord | None = None,
    ) -> None:
        self._token, self._accounts, self._asks_people = token, accounts, asks_people
        self.takes_passwords, self.sign_on, self._record = takes_passwords, sign_on, record
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
        # A token may be that of a person's script, and one that is wrong gets a row.
        return self.needed and "authorization" in request.headers

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
        self._record_entry(request, TOKEN_PERSON, "token")
        return self.sessions.begin()

    def new_session_of(self, request: Request, name: str, password: str) -> str:
        """The identifier of a new session of a user; the one before it ends. Raises `SignInError`,
        with the same words for an unknown name as for a wrong password."""
        if not self.takes_passwords:
            raise SignInError(403, "nobody signs in here with a password")
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
            self._record_failure(request, "password", name)
            raise SignInError(401, "the name or the password is wrong")
        self.attempts.succeeded(_host(request))
        self.attempts_by_name.succeeded(name)
        self.sessions.end(session_of(request) or "")
        self._record_entry(request, person[0], "password")
        return self.sessions.begin(*person)

    def new_session_of_account(
        self, request: Request, cookie: str, query: Mapping[str, str]
    ) -> tuple[str, str]:
        """The identifier of a new session of who has signed in at the identity provider, and the
        address of the page that was asked for.

        Parameters:
            request: The request with which the browser comes back.
            cookie: What it has kept since the sign-in began (`SignOn.begin`).
            query: What the provider sends with it.

        Raises:
            SignInError: 401 where nothing is proved, 403 for an account that is nobody's here.
        """
        if self.sign_on is None or self._accounts is None:
            raise SignInError(404, "this server has no single sign-on")
        self._check_wait(request)
        try:
            account, address = self.sign_on.finish(cookie, query)
            person = self._accounts.by_account(
                account, self.sign_on.settings.rules, _host(request), self._record
            )
        except NotAdmittedError as error:
            self._record_failure(request, PROVIDER_WAY, message=str(error))
            raise SignInError(403, str(error)) from error
        except ProviderError as error:
            if error.is_a_refusal:
                self.attempts.failed(_host(request))
                self._record_failure(request, PROVIDER_WAY, message=str(error))
            raise SignInError(401, str(error)) from error
        self.attempts.succeeded(_host(request))
        self.sessions.end(session_of(request) or "")
        return self.sessions.begin(*person), address

    def sign_out(self, request: Request, person: Person, *, everywhere: bool = False) -> None:
        """End the session of this browser, or with `everywhere` those of the person on all devices;
        for anybody but a user, all of this server."""
        identifier = session_of(request) or ""
        if self._record is not None and self.sessions.is_open(identifier):
            self._record.signed_out(person, _host(request), everywhere=everywhere)
        self.sessions.end(identifier)
        if everywhere:
            self.end_sessions_of(person)

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
            self._record_failure(request, "token")
            raise SignInError(401, "this is not the server's token")
        self.attempts.succeeded(_host(request))

    def _record_entry(self, request: Request, person: Person, method: str) -> None:
        if self._record is not None:
            self._record.signed_in(person, _host(request), method)

    def _record_failure(
        self, request: Request, method: str, name: str = "", message: str = ""
    ) -> None:
        if self._record is not None:
            self._record.failed(_host(request), method, name, message)


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
