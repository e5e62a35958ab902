"""Sessions that were signed in: they end after a time without requests, after a time at all, and
when they are told to.

They are kept in this process alone, by the SHA-256 of their identifier: a restart of the server
ends all of them.
"""

from __future__ import annotations

import hashlib
import secrets
import time
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass

from ...schema.person_roles import TOKEN_PERSON, Person

#: Seconds without a request, and seconds at all, after which a session has ended (OWASP, Session
#: Management Cheat Sheet): a break at the bench, and a working day.
IDLE_S = 2 * 3600.0
LIFETIME_S = 12 * 3600.0
#: Sessions at once; beyond, the one that was used longest ago ends.
SESSIONS = 1_000


@dataclass
class OpenSession:
    """Whose session it is; `generation` is that of the user when it began (`schema.users`)."""

    person: Person
    generation: int
    began: float
    used: float


class Sessions:
    """The open sessions. `clock` gives seconds that only grow."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._open: OrderedDict[bytes, OpenSession] = OrderedDict()

    def begin(self, person: Person = TOKEN_PERSON, generation: int = 0) -> str:
        """A new session's identifier, of 256 random bits."""
        identifier, now = secrets.token_urlsafe(32), self._clock()
        while len(self._open) >= SESSIONS:
            self._open.popitem(last=False)
        self._open[_digest(identifier)] = OpenSession(person, generation, now, now)
        return identifier

    def is_open(self, identifier: str) -> bool:
        """Whether the session is open; a request that asks this is a use of it."""
        return self.find(identifier) is not None

    def find(self, identifier: str) -> OpenSession | None:
        """The open session; a request that asks this is a use of it."""
        digest, now = _digest(identifier), self._clock()
        session = self._open.get(digest)
        if session is None:
            return None
        if now - session.used > IDLE_S or now - session.began > LIFETIME_S:
            del self._open[digest]
            return None
        session.used = now
        self._open.move_to_end(digest)
        return session

    def end(self, identifier: str) -> None:
        """End one session; one that is not open stays so."""
        self._open.pop(_digest(identifier), None)

    def end_of(self, user_id: int) -> None:
        """End every session of a user, on all devices."""
        for digest in [
            key
            for key, open_session in self._open.items()
            if open_session.person.user_id == user_id
        ]:
            del self._open[digest]

    def end_all(self) -> None:
        """End every session, on all devices."""
        self._open.clear()


def _digest(identifier: str) -> bytes:
    return hashlib.sha256(identifier.encode(errors="surrogateescape")).digest()
