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

#: Seconds without a request, and seconds at all, after which a session has ended (OWASP, Session
#: Management Cheat Sheet): a break at the bench, and a working day.
IDLE_S = 2 * 3600.0
LIFETIME_S = 12 * 3600.0
#: Sessions at once; beyond, the one that was used longest ago ends.
SESSIONS = 1_000


@dataclass
class _Session:
    began: float
    used: float


class Sessions:
    """The open sessions. `clock` gives seconds that only grow."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._open: OrderedDict[bytes, _Session] = OrderedDict()

    def begin(self) -> str:
        """A new session's identifier, of 256 random bits."""
        identifier, now = secrets.token_urlsafe(32), self._clock()
        while len(self._open) >= SESSIONS:
            self._open.popitem(last=False)
        self._open[_digest(identifier)] = _Session(now, now)
        return identifier

    def is_open(self, identifier: str) -> bool:
        """Whether the session is open; a request that asks this is a use of it."""
        digest, now = _digest(identifier), self._clock()
        session = self._open.get(digest)
        if session is None:
            return False
        if now - session.used > IDLE_S or now - session.began > LIFETIME_S:
            del self._open[digest]
            return False
        session.used = now
        self._open.move_to_end(digest)
        return True

    def end(self, identifier: str) -> None:
        """End one session; one that is not open stays so."""
        self._open.pop(_digest(identifier), None)

    def end_all(self) -> None:
        """End every session, on all devices."""
        self._open.clear()


def _digest(identifier: str) -> bytes:
    return hashlib.sha256(identifier.encode(errors="surrogateescape")).digest()
