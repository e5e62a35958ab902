"""People who sign in, looked up in the store: by their password, their session, the token of a
script and their account at the identity provider."""

from __future__ import annotations

from sqlalchemy.orm import Session

from ...schema.person_roles import Person
from ...schema.session import Store
from ..operations.people.stored_identities import (
    AdmissionRules,
    ProviderAccount,
    account_person,
    admit,
)
from ..operations.people.stored_users import (
    person_of_password,
    person_of_session,
    person_of_token,
)
from .sign_in_record import NOBODY, SignInRecord

#: What a row of the audit trail calls the way in through an identity provider.
PROVIDER_WAY = "identity provider"


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

    def by_account(
        self,
        account: ProviderAccount,
        rules: AdmissionRules,
        host: str | None = None,
        record: SignInRecord | None = None,
    ) -> tuple[Person, int]:
        """The person of an account at the identity provider, and the generation of the session that
        begins. A user who is bound, added or given another role has the row of the audit trail in
        the same transaction.

        Raises:
            NotAdmittedError: Where the account is nobody's here.
            StoreRoleError: Where the server's login may not write users, and one must be written.
        """
        seen = self._store.read(lambda session: account_person(session, account))
        if seen is not None and not seen[2]:  # nothing is to be written but the row
            if record is not None:
                record.signed_in(seen[0], host, PROVIDER_WAY)
            return seen[0], seen[1]
        if record is None:
            return self._store.write(lambda session: admit(session, account, rules))
        store = record.store_of(NOBODY)

        def admitted(session: Session) -> tuple[Person, int]:
            person, generation = admit(session, account, rules)
            session.add(record.entry(person, host, PROVIDER_WAY).row())
            return person, generation

        return store.write(admitted)
