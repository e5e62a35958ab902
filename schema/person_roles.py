"""Who asks for something: a person with a name and a role.

Roles build on each other: what a reader may, an operator may too. They are the software's own, for
people who come through its pages and its API; what a login of PostgreSQL may do is said in
`access/permissions.py`, and holds beside them.
"""

from __future__ import annotations

import getpass
from dataclasses import dataclass

READER, OPERATOR, ENGINEER, ADMINISTRATOR = "reader", "operator", "engineer", "administrator"
#: From the one that may least to the one that may all.
PERSON_ROLES = (READER, OPERATOR, ENGINEER, ADMINISTRATOR)
#: What each may, in a person's words.
ROLE_WORDS = {
    READER: "read everything but users and the audit trail, and predict",
    OPERATOR: "also ingest, record runs, tune, validate, and write notes and tags",
    ENGINEER: "also plan, train, promote, diagnose, adopt and archive, and read the audit trail",
    ADMINISTRATOR: "also manage users and materials, delete and restore",
}

#: How a person is known: by a row of `users`, by the server's one token, as whoever sits at a
#: server that asks for no token, or by the operating system (the command line and Python).
USER, TOKEN, LOCAL, SYSTEM = PERSON_KINDS = ("user", "token", "local", "system")


class RoleNeededError(ValueError):
    """A person lacks the role that something needs; the message names it and who can give it."""


@dataclass(frozen=True)
class Person:
    """`user_id` is the key of the row of a user, 0 of anybody else."""

    name: str
    role: str = ADMINISTRATOR
    kind: str = SYSTEM
    user_id: int = 0

    def may(self, role: str) -> bool:
        """Whether the person has this role, or one that may more."""
        return PERSON_ROLES.index(self.role) >= PERSON_ROLES.index(role)

    def check_may(self, role: str, what: str) -> None:
        """Refuse what needs another role.

        Parameters:
            role: The role that is needed.
            what: What is asked for, as the subject of a sentence: "the operation train".

        Raises:
            RoleNeededError: Where the person's role may less.
        """
        if not self.may(role):
            raise RoleNeededError(
                f"{what} needs the role {role}, and {self.name} has the role {self.role}; an "
                f"administrator can give it: pyroshock users change {self.name} --role {role}"
            )


TOKEN_PERSON = Person("token", kind=TOKEN)
LOCAL_PERSON = Person("local", kind=LOCAL)


def system_person() -> Person:
    """Whoever runs this process, by the name that the operating system knows."""
    try:
        return Person(getpass.getuser())
    except (KeyError, OSError):  # a container's user without a name
        return Person("unknown")
