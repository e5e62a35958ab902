"""People who sign in, looked up in the store: by their password, their session and the token of a
script."""

from __future__ import annotations

from ...schema.person_roles import Person
from ...schema.session import Store
from ..operations.people.stored_users import (
    person_of_password,
    person_of_session,
    person_of_token,
)


class Accounts:
    """The users of a store. For use from several threads; each call reads the store once."""

    def __init__(self, store: Store) -> None:
        self._store = store

    def by_password(self, name: str, password: str) -> tuple[Person, int] | None:
        """The person, and the generation of the session that begins; None for a wrong password and
        for an unknown name, after about the same time."""
        return self._store.read(lambda session: person_of_password(session, name, password))

    def by_session(self, user_id: int, generation: int) -> Person | None:
        """The person of an open session, with the role of this moment; None where it has ended."""
        return self._store.read(lambda session: person_of_session(session, user_id, generation))

    def by_token(self, token: str) -> Person | None:
        """The person whose script sends a token; None where nobody's does."""
        return self._store.read(lambda session: person_of_token(session, token))
