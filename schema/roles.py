"""Who may do what in a store on PostgreSQL: three roles without a login, that logins are made members of.

A reader looks; an operator also works (ingest, plan, train, diagnose); an admin owns the tables and changes them. A
login becomes one of them by `GRANT pyroshock_reader TO "alice"`. Roles are the server's, for all of its stores; what
they may do in a store is that store's own. A file of SQLite has no roles: who may write the file may do all.
"""

from __future__ import annotations

from typing import Any

from sqlalchemy import Connection, text
from sqlalchemy.exc import DBAPIError

from .permissions import ADMIN, VERSION, missing_roles, tables_of
from .role_statements import (
    GIVE,
    LOGIN,
    OF_LATER_ONES,
    OF_THE_SCHEMA,
    OF_THE_TABLES,
    TAKE,
    TAKE_ALL,
    identifier,
    names_in,
    run,
)

#: SQLSTATE of a role that another transaction has made meanwhile: duplicate_object, unique_violation.
_MADE_BY_ANOTHER = ("42710", "23505")

_OWNER = text("SELECT tableowner FROM pg_tables WHERE schemaname = current_schema() AND tablename = :table")
_MEMBER = text("SELECT pg_has_role(current_user, CAST(:role AS name), :how)")
_MAKES_TABLES = text("SELECT has_schema_privilege(CAST(:role AS name), current_schema(), 'CREATE')")


def grant_roles(connection: Connection) -> bool:
    """Make the roles that the server lacks, and give each its rights in this store, whose tables become the admin's.

    May be run again: what is there stays. False where a role is missing and the login may not make one (it lacks
    CREATEROLE): nothing is granted then.
    """
    _act_as_login(connection)
    _, may_make, is_super = connection.execute(LOGIN).one()
    missing = missing_roles(connection)
    if missing and not may_make:
        return False
    for role in missing:
        _make(connection, role, joined=role == ADMIN and not is_super)
    names = names_in(connection)
    for statement in (*OF_THE_SCHEMA, *OF_THE_TABLES):
        run(connection, statement, names)
    for maker in _makers(connection):
        for rights, role in OF_LATER_ONES:
            run(connection, f"{GIVE}{rights} TO {role}", names | maker)
    if _may_act_as_admin(connection) and connection.scalar(_MAKES_TABLES, {"role": ADMIN}):
        _hand_over(connection, names, "{admin}")
    return True


def revoke_roles(connection: Connection) -> None:
    """Take all rights in this store back; its tables become the login's. The roles stay: other stores have them."""
    _act_as_login(connection)
    if missing_roles(connection):
        return
    names = names_in(connection)
    _hand_over(connection, names, "{login}")
    for maker in _makers(connection):
        for rights, role in OF_LATER_ONES:
            run(connection, f"{TAKE}{rights} FROM {role}", names | maker)
    for statement in TAKE_ALL:
        run(connection, statement, names)


def owns(connection: Connection) -> bool:
    """Whether the login, or a role it is a member of, owns the store: another's grants have no effect."""
    owner = connection.scalar(_OWNER, {"table": VERSION})
    return owner is None or bool(connection.scalar(_MEMBER, {"role": owner, "how": "USAGE"}))


def act_as_owner(connection: Connection) -> None:
    """Where the tables are the admin's, be the admin for this transaction: what it makes is the admin's, too."""
    if connection.scalar(_OWNER, {"table": VERSION}) == ADMIN and _may_act_as_admin(connection):
        run(connection, "SET LOCAL ROLE {admin}", {"admin": identifier(ADMIN)})


def _act_as_login(connection: Connection) -> None:
    connection.execute(text("SET LOCAL ROLE NONE"))


def _make(connection: Connection, role: str, *, joined: bool) -> None:
    """`joined`: the login becomes a member. Another store of the server may be making the role at this moment."""
    name = {"role": identifier(role)}
    try:
        with connection.begin_nested():
            run(connection, "CREATE ROLE {role} NOLOGIN", name)
    except DBAPIError as error:
        if getattr(error.orig, "sqlstate", None) not in _MADE_BY_ANOTHER:
            raise
        return
    if joined:
        run(connection, "GRANT {role} TO CURRENT_USER", name)


def _may_act_as_admin(connection: Connection) -> bool:
    version = connection.dialect.server_version_info or (0,)
    how = "SET" if version >= (16,) else "MEMBER"
    return bool(connection.scalar(_MEMBER, {"role": ADMIN, "how": how}))


def _makers(connection: Connection) -> list[dict[str, Any]]:
    """Who may make tables later: the login, and the admin where the login may speak for it."""
    login, *_ = connection.execute(LOGIN).one()
    makers = dict.fromkeys([login, ADMIN] if _may_act_as_admin(connection) else [login])
    return [{"maker": identifier(maker)} for maker in makers]


def _hand_over(connection: Connection, names: dict[str, Any], owner: str) -> None:
    """Sequences and indexes go with their tables."""
    for table in tables_of(connection):
        run(connection, f"ALTER TABLE {{table}} OWNER TO {owner}", names | {"table": identifier(table)})
