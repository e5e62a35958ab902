"""People in the store: looked up, added, changed and removed; and the tokens of their scripts."""

from __future__ import annotations

import hashlib
import re
import secrets
from datetime import UTC, datetime
from typing import Any

from sqlalchemy import Select, select
from sqlalchemy.orm import Session

from ....schema.person_roles import ADMINISTRATOR, PERSON_ROLES, USER, Person
from ....schema.sign_on_identities import SignOnIdentity
from ....schema.users import PasswordHash, PersonalToken, User
from .passwords import check_password, hash_of_nobody, hash_password, is_password

#: Begins a token that a person has made; the server's own token may be any word.
TOKEN_BEGIN = "pyroshock_"  # noqa: S105  # the same of every token, and no secret
#: A name that a person signs in with; those of others than users are nobody's.
NAME = re.compile(r"[a-z0-9][a-z0-9._-]{0,63}")
RESERVED_NAMES = ("token", "local", "nobody", "unknown")


class UnknownUserError(LookupError):
    """The store has no user of this name."""


def get_user(session: Session, name: str) -> User:
    """The user of a name, also one who was removed. Raises `UnknownUserError`."""
    user = session.scalars(select(User).where(User.name == name)).one_or_none()
    if user is None:
        raise UnknownUserError(f"no user {name!r} in the store; pyroshock users lists them")
    return user


def add_user(session: Session, name: str, role: str, password: str) -> User:
    """Add a person, or take back one who was removed, with a new password.

    Raises `ValueError` for a name that is taken or cannot be one, and `PasswordError`.
    """
    if not NAME.fullmatch(name) or name in RESERVED_NAMES:
        raise ValueError(
            f"name is {name!r}; expected small letters, digits, and . _ - between them, and none "
            f"of {', '.join(RESERVED_NAMES)}"
        )
    check_password(password, name)
    now = datetime.now(UTC)
    user = session.scalars(select(User).where(User.name == name)).one_or_none()
    if user is not None and user.removed_at is None:
        raise ValueError(f"user {name!r} exists already; pyroshock users change {name} changes it")
    if user is None:
        user = User(name=name, role=role, made_at=now)
        session.add(user)
    else:
        user.role, user.removed_at, user.generation = role, None, user.generation + 1
    session.flush()
    _set_password(session, user, password)
    return user


def change_role(session: Session, name: str, role: str) -> None:
    """Give a user another role. Raises `UnknownUserError`, and `ValueError` for the last
    administrator."""
    user = present_user(session, name)
    if role != ADMINISTRATOR:
        _check_not_last(session, user)
    user.role = role


def remove_user(session: Session, name: str) -> None:
    """End all that a user may do: sessions and tokens open nothing from now on. The name stays in
    the audit trail. Raises as `change_role`."""
    user = present_user(session, name)
    _check_not_last(session, user)
    user.removed_at, user.generation = datetime.now(UTC), user.generation + 1
    tokens = select(PersonalToken).where(
        PersonalToken.user_id == user.id, PersonalToken.revoked_at.is_(None)
    )
    for token in session.scalars(tokens):
        token.revoked_at = user.removed_at
    # The account at the identity provider and its login are free for others.
    for identity in session.scalars(_identity_of(user)):
        session.delete(identity)


def set_password(session: Session, name: str, password: str) -> None:
    """Give a user another password, and end the sessions of the one before. Raises
    `UnknownUserError`, `PasswordError`."""
    check_password(password, name)
    user = present_user(session, name)
    user.generation += 1
    _set_password(session, user, password)


def forget_password(session: Session, user: User) -> None:
    """Leave a user without a password: another way in is the only one."""
    for row in session.scalars(select(PasswordHash).where(PasswordHash.user_id == user.id)):
        session.delete(row)


def has_password(session: Session, user_id: int) -> bool:
    """Whether a user signs in with a password."""
    own = select(PasswordHash.id).where(PasswordHash.user_id == user_id)
    return session.scalar(own) is not None


def _identity_of(user: User) -> Select[SignOnIdentity]:
    return select(SignOnIdentity).where(SignOnIdentity.user_id == user.id)


def _set_password(session: Session, user: User, password: str) -> None:
    own = select(PasswordHash).where(PasswordHash.user_id == user.id)
    row = session.scalars(own).one_or_none()
    argon2, now = hash_password(password), datetime.now(UTC)
    if row is None:
        session.add(PasswordHash(user_id=user.id, argon2=argon2, changed_at=now))
    else:
        row.argon2, row.changed_at = argon2, now


def present_user(session: Session, name: str) -> User:
    user = get_user(session, name)
    if user.removed_at is not None:
        raise UnknownUserError(f"user {name!r} was removed; pyroshock users add {name} takes back")
    return user


def _check_not_last(session: Session, user: User) -> None:
    administrators = select(User.id).where(
        User.role == ADMINISTRATOR, User.removed_at.is_(None), User.id != user.id
    )
    if user.role == ADMINISTRATOR and session.scalars(administrators.limit(1)).first() is None:
        raise ValueError(
            f"{user.name} is the last administrator; give another user that role first"
        )


def user_rows(session: Session) -> list[dict[str, Any]]:
    """All users, those who were removed last, without what they sign in with. `login` is that at
    the laboratory's identity provider, of those who come through it; `bound`: an account has signed
    in with it."""
    query = (
        select(User, SignOnIdentity)
        .outerjoin(SignOnIdentity, SignOnIdentity.user_id == User.id)
        .order_by(User.removed_at.is_not(None), User.name)
    )
    return [
        {
            "name": user.name,
            "role": user.role,
            "login": identity and identity.login,
            "bound": identity and identity.subject is not None,
            "made_at": user.made_at.isoformat(timespec="seconds"),
            "removed_at": user.removed_at and user.removed_at.isoformat(timespec="seconds"),
        }
        for user, identity in session.execute(query)
    ]


# --- signing in


def person_of_password(session: Session, name: str, password: str) -> tuple[Person, int] | None:
    """The person whose password this is, and the generation of the sessions that begin now; None
    for a wrong password, a removed user and an unknown name, each after about the same time."""
    query = (
        select(User, PasswordHash.argon2)
        .join(PasswordHash, PasswordHash.user_id == User.id)
        .where(User.name == name, User.removed_at.is_(None))
    )
    row = session.execute(query).one_or_none()
    if not is_password(hash_of_nobody() if row is None else row.argon2, password) or row is None:
        return None
    return _person(row.User), row.User.generation


def person_of_session(session: Session, user_id: int, generation: int) -> Person | None:
    """The person of an open session with the role of this moment; None where the person was
    removed, or has another password since."""
    user = session.get(User, user_id)
    if user is None or user.removed_at is not None or user.generation != generation:
        return None
    return _person(user)


def person_of_token(session: Session, token: str) -> Person | None:
    """The person whose script sends a token, with the lesser role of the two; None for a token that
    is not known or was revoked."""
    query = (
        select(PersonalToken.role, User)
        .join(User, PersonalToken.user_id == User.id)
        .where(
            PersonalToken.sha256 == hash_of_token(token),
            PersonalToken.revoked_at.is_(None),
            User.removed_at.is_(None),
        )
    )
    row = session.execute(query).one_or_none()
    if row is None:
        return None
    return Person(row.User.name, lesser_role(row.role, row.User.role), USER, row.User.id)


def _person(user: User) -> Person:
    return Person(user.name, user.role, USER, user.id)


def lesser_role(first: str, second: str) -> str:
    """Of two roles, the one that may less."""
    return min(first, second, key=PERSON_ROLES.index)


def hash_of_token(token: str) -> str:
    """SHA-256 of a token: it is random, and long enough that nobody can try all."""
    return hashlib.sha256(token.encode(errors="surrogateescape")).hexdigest()


def new_token() -> str:
    """A new token, of 256 random bits."""
    return TOKEN_BEGIN + secrets.token_urlsafe(32)
