"""What each role may do in a store on PostgreSQL, and what a database refuses, in words: where a login lacks a role,
which one. A file of SQLite is its owner's, whole."""

from __future__ import annotations

from sqlalchemy import Connection, Engine, func, select, text
from sqlalchemy.exc import DBAPIError

from ..engine import StoreError, StoreRoleError, describe, first_line
from ..tables import metadata

READER, OPERATOR, ADMIN = ROLES = ("pyroshock_reader", "pyroshock_operator", "pyroshock_admin")

#: Where Alembic keeps the revision.
VERSION = "alembic_version"
#: All that the software deletes from: a recording that was set aside, and a series that was damaged in the store, make
#: room for their mended selves.
DELETED_FROM = ("recordings", "series_chunks")
#: Rows of these are added and stay as they are: who wrote what is not changed afterwards.
NEVER_CHANGED = ("provenance",)

_THE_TABLES = text("SELECT tablename FROM pg_tables WHERE schemaname = current_schema()")
_THE_ROLES = text("SELECT rolname FROM pg_roles WHERE rolname LIKE 'pyroshock%'")


def tables_of(connection: Connection) -> list[str]:
    """The store's own tables that are there, and Alembic's; not what else may lie in the same database."""
    return sorted({VERSION, *metadata.tables} & set(connection.scalars(_THE_TABLES)))


def missing_roles(connection: Connection) -> list[str]:
    """Roles that the server does not have."""
    existing_roles = set(connection.scalars(_THE_ROLES))
    return [role for role in ROLES if role not in existing_roles]


def missing_rights(connection: Connection) -> list[str]:
    """What a role should be able to do and cannot, as "pyroshock_reader: SELECT on impacts"."""
    wanted = [(role, table, right) for table in tables_of(connection) for role, right in rights_on(table)]
    held = connection.execute(select(*(func.has_table_privilege(*privilege) for privilege in wanted))).one()
    return [f"{role}: {right} on {table}" for (role, table, right), has in zip(wanted, held, strict=True) if not has]


def rights_on(table: str) -> list[tuple[str, str]]:
    """(role, right) of each role on a table."""
    operator = {"SELECT", "INSERT", "UPDATE"}
    if table in NEVER_CHANGED:
        operator -= {"UPDATE"}
    if table == VERSION:
        operator = {"SELECT"}
    if table in DELETED_FROM:
        operator |= {"DELETE"}
    admin = ("SELECT", "INSERT", "UPDATE", "DELETE")
    return [(READER, "SELECT"), *((OPERATOR, right) for right in sorted(operator)), *((ADMIN, r) for r in admin)]


#: SQLSTATE insufficient_privilege: "permission denied for table ..", "must be owner of table ..".
_DENIED = "42501"
#: First words of statements that an operator may use; others change tables.
_CHANGE_ROWS = ("INSERT", "UPDATE", "DELETE")


def refusal(engine: Engine, error: DBAPIError, subject: str | None = None) -> StoreError:
    """The error to raise for a driver's; `subject` is what it says it of, else the store's address."""
    message = f"{subject or describe(engine)}: {first_line(error)}"
    role = needed_role(error)
    if role is None:
        return StoreError(message)
    login = engine.url.username or "LOGIN"
    return StoreRoleError(f'{message}; this needs the role {role}: an administrator runs GRANT {role} TO "{login}"')


def needed_role(error: DBAPIError) -> str | None:
    """The role that a refused statement needs; None where it was refused for another reason."""
    if getattr(error.orig, "sqlstate", None) != _DENIED:
        return None
    words = (error.statement or "").split() or [""]
    if words[0].upper() == "SELECT":
        # Who locks a row, or takes a key for a new one (`row_keys`), is about to write.
        statement = " ".join(words)
        return OPERATOR if "FOR UPDATE" in statement or "nextval(" in statement else READER
    if words[:2] == ["DELETE", "FROM"] and words[2] not in DELETED_FROM:
        return ADMIN
    return OPERATOR if words[0].upper() in _CHANGE_ROWS and VERSION not in words else ADMIN
