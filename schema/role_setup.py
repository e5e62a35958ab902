"""Making and mending the roles of a store, and who has them."""

from __future__ import annotations

from dataclasses import dataclass

from sqlalchemy import Connection, Engine, text
from sqlalchemy.exc import DBAPIError

from .engine import StoreError, StoreRoleError, describe
from .permission_errors import refusal
from .permissions import ADMIN, OPERATOR, READER, ROLES, missing_rights, missing_roles
from .roles import grant_roles, owns

#: What each role is for, in a person's words.
MAY = {
    READER: "look: lists, exports, predictions, reports",
    OPERATOR: "and work: ingest, plan, train, diagnose",
    ADMIN: "and upgrade the store, whose tables it owns",
}
_MEMBERS = text(
    "SELECT granted.rolname, member.rolname FROM pg_auth_members"
    " JOIN pg_roles granted ON granted.oid = roleid JOIN pg_roles member ON member.oid = pg_auth_members.member"
    " ORDER BY member.rolname"
)


@dataclass(frozen=True)
class Role:
    """A role of the server, what it may do in a store, and the logins that have it."""

    name: str
    may: str
    members: tuple[str, ...]


def ensure_roles(engine: Engine) -> list[Role]:
    """Make the roles that are missing and grant what they lack, in one transaction; safe to repeat.

    Raises `StoreRoleError` for a login that does not own the store, and `StoreError` where there are no roles
    (SQLite), or the login may not make them.
    """
    if engine.dialect.name != "postgresql":
        raise StoreError(
            f"{describe(engine)} has no roles: whoever may write the file may do all (chmod, or PostgreSQL)"
        )
    try:
        with engine.begin() as connection:
            if not owns(connection):
                raise StoreRoleError(f"{describe(engine)}: only its owner grants; this needs the role {ADMIN}")
            if not grant_roles(connection):
                raise StoreError(f"{describe(engine)}: {how_to_make_roles(missing_roles(connection))}")
            if lacking := missing_rights(connection):
                raise StoreError(f"{describe(engine)}: not granted: {', '.join(lacking)}; is another their owner?")
            return _roles(connection)
    except DBAPIError as error:
        raise refusal(engine, error) from error


def without_roles(engine: Engine) -> str | None:
    """What to tell who has just made or upgraded a store whose roles could not be made; None where all is well."""
    if engine.dialect.name != "postgresql":
        return None
    with engine.connect() as connection:
        missing = missing_roles(connection)
    return how_to_make_roles(missing) if missing else None


def how_to_make_roles(missing: list[str]) -> str:
    """The next step of a login that may not make roles."""
    return (
        f"the server has no role {', '.join(missing)}, and this login may not make one: with a login that has "
        "CREATEROLE, or after CREATE ROLE by an administrator, run pyroshock db roles"
    )


def _roles(connection: Connection) -> list[Role]:
    rows = connection.execute(_MEMBERS).all()
    return [Role(name, MAY[name], tuple(member for role, member in rows if role == name)) for name in ROLES]
