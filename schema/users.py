"""People who sign in: their names and roles, the hashes of their passwords, and the tokens that
they have made for their scripts.

Hashes stand in tables of their own, which a reader of a store on PostgreSQL may not read, and which
`pyroshock query` refuses to everybody.
"""

from __future__ import annotations

from datetime import datetime

from sqlalchemy import CheckConstraint, ForeignKey
from sqlalchemy.orm import Mapped, mapped_column, relationship

from .base import Base, HasId, WithProvenance, names_row, one_of
from .person_roles import PERSON_ROLES


class User(HasId, WithProvenance, Base):
    """A person. The row stays when the person is removed, for the audit trail names it."""

    __tablename__ = "users"
    __table_args__ = (
        CheckConstraint(one_of("role", PERSON_ROLES), "role_known"),
        CheckConstraint("length(name) BETWEEN 1 AND 64", "name_length"),
        CheckConstraint("generation >= 1", "generation_positive"),
    )

    name: Mapped[str] = mapped_column(unique=True, info=names_row("user"))
    role: Mapped[str]
    made_at: Mapped[datetime]
    #: Sessions and tokens of a removed person open nothing.
    removed_at: Mapped[datetime | None]
    #: Rises with each new password and with a removal: a session of an earlier number has ended.
    generation: Mapped[int] = mapped_column(default=1)


class PasswordHash(HasId, WithProvenance, Base):
    """The password of a person, as Argon2id made it, with its salt and its parameters."""

    __tablename__ = "password_hashes"

    user_id: Mapped[int] = mapped_column(ForeignKey("users.id"), unique=True)
    argon2: Mapped[str]
    changed_at: Mapped[datetime]
    user: Mapped[User] = relationship()


class PersonalToken(HasId, WithProvenance, Base):
    """A token that a person has made for scripts. It is shown once; the store has its SHA-256."""

    __tablename__ = "personal_tokens"
    __table_args__ = (
        CheckConstraint(one_of("role", PERSON_ROLES), "role_known"),
        CheckConstraint("length(sha256) = 64", "sha256_length"),
    )

    #: "which tokens has this person": the page of the account
    user_id: Mapped[int] = mapped_column(ForeignKey("users.id"), index=True)
    label: Mapped[str] = mapped_column(info=names_row("token"))
    role: Mapped[str]  # no more than this, and no more than the person's own
    #: "whose token is this": each request of a script
    sha256: Mapped[str] = mapped_column(unique=True)
    made_at: Mapped[datetime]
    revoked_at: Mapped[datetime | None]
    user: Mapped[User] = relationship()


#: Tables whose rows open doors: no question in SQL reads them.
SECRET_TABLES = ("password_hashes", "personal_tokens")
