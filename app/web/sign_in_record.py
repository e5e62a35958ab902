"""Sign-ins, those that failed and sign-outs in the audit trail: who, when, from which address, by
which way. Neither passwords nor tokens stand there, nor a name that is no user's, for people type
their password into the field of the name, too."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable

from sqlalchemy import select
from sqlalchemy.exc import DBAPIError
from sqlalchemy.orm import Session

from ... import __version__
from ...schema.audit import DONE, FAILED, AuditEntry
from ...schema.engine import StoreError
from ...schema.person_roles import LOCAL, READER, Person
from ...schema.session import Store, Writer
from ...schema.users import User
from .client_address import client_network

#: Who sends a request of which nobody knows.
NOBODY = Person("nobody", READER, LOCAL)
SIGN_IN, SIGN_OUT = "sign-in", "sign-out"
#: Failed sign-ins that get a row in an hour, in one process; those beyond are counted in the next
#: row. Who guesses takes some 20 kB of the store in an hour, and no more.
ROWS_AN_HOUR = 60
_HOUR_S = 3600.0

_log = logging.getLogger("pyroshock.web")


class SignInRecord:
    """Writes the rows. For use from several threads. `clock` gives seconds that only grow.

    A store that takes no rows (its login only reads, its disk is full) lets people sign in all the
    same: the fault is logged.
    """

    def __init__(self, store: Store, clock: Callable[[], float] = time.monotonic) -> None:
        self._store, self._clock = store, clock
        self._lock = threading.Lock()
        self._hour_began, self._rows, self._unlisted = float("-inf"), 0, 0

    def signed_in(self, person: Person, host: str | None, method: str) -> None:
        """A person has come in. `method`: password, token, or the identity provider."""
        self._write(self.entry(person, host, method), DONE)

    def signed_out(self, person: Person, host: str | None, *, everywhere: bool) -> None:
        """A person has ended the session of a browser, or all."""
        request = {"from": client_network(host), **({"all_devices": True} if everywhere else {})}
        self._write(AuditEntry(person, SIGN_OUT, "", request), DONE)

    def failed(self, host: str | None, method: str, name: str = "", message: str = "") -> None:
        """Somebody was refused. `name` is what was typed as one."""
        with self._lock:
            now = self._clock()
            if now - self._hour_began >= _HOUR_S:
                self._hour_began, self._rows = now, 0
            if self._rows >= ROWS_AN_HOUR:
                self._unlisted += 1
                return
            self._rows += 1
            unlisted, self._unlisted = self._unlisted, 0
        entry = self.entry(NOBODY, host, method)
        if unlisted:
            entry.request["failed_before_without_a_row"] = unlisted
        self._write(entry, FAILED, message, name)

    @staticmethod
    def entry(person: Person, host: str | None, method: str) -> AuditEntry:
        """What a row will say of a sign-in."""
        return AuditEntry(person, SIGN_IN, "", {"way": method, "from": client_network(host)})

    def store_of(self, person: Person) -> Store:
        """The store, written by a person who signs in or out."""
        return Store(self._store.engine, Writer("serve: sign-in", __version__, person))

    def _write(self, entry: AuditEntry, outcome: str, message: str = "", name: str = "") -> None:
        def add(session: Session) -> None:
            if name and session.scalar(select(User.id).where(User.name == name)) is not None:
                entry.subject = name
            session.add(entry.row(outcome, message or None))

        try:
            self.store_of(entry.person).write(add)
        except (StoreError, DBAPIError, OSError) as error:
            # Who is locked out cannot mend the store.
            _log.warning("a %s has no row in the audit trail: %s", entry.operation, error)
