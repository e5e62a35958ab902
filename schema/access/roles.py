"""Who may do what in a store on PostgreSQL: three roles without a login, that logins are made
members of.

A reader looks; an operator also works (ingest, plan, train, diagnose); an admin owns the tables and
changes them. A login becomes one of them by `GRANT pyroshock_reader TO "alice"`. Roles are the
server's, for all of its stores; what they may do in a store is that store's own. A file of SQLite
has no roles: who may write the file may do all.

The statements take no parameters: `psycopg.sql` quotes the names that they hold.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from sqlalchemy import Connection, Engine, text
from sqlalchemy.exc import DBAPIError

from ..engine import StoreError, StoreRoleError, describe
from ..users import SECRET_TABLES
from .permissions import (
    ADMIN,
    APPEND_ONLY,
    CHANGED_COLUMNS,
    DELETED_FROM,
    OPERATOR,
    PEOPLE,
    READER,
    ROLES,
    VERSION,
    changed_columns,
    functions_of,
    missing_rights,
    missing_roles,
    refusal,
    tables_of,
)

OF_THE_SCHEMA = (
    "GRANT USAGE ON SCHEMA {schema} TO {reader}, {operator}, {admin}",
    "GRANT CREATE ON SCHEMA {schema} TO {admin}",
)
OF_THE_TABLES = (
    "GRANT SELECT ON TABLE {tables} TO {reader}",
    "GRANT SELECT, INSERT, UPDATE ON TABLE {tables} TO {operator}",
    "REVOKE DELETE ON TABLE {tables} FROM {operator}",
    "REVOKE UPDATE ON TABLE {append_only} FROM {operator}",
    "REVOKE INSERT, UPDATE ON TABLE {version} FROM {operator}",
    "GRANT ALL ON TABLE {tables} TO {admin}",
)
OF_THE_SEQUENCES = (
    "GRANT SELECT ON ALL SEQUENCES IN SCHEMA {schema} TO {reader}",
    "GRANT USAGE, SELECT ON ALL SEQUENCES IN SCHEMA {schema} TO {operator}",
    "GRANT ALL ON ALL SEQUENCES IN SCHEMA {schema} TO {admin}",
)
#: Of tables and sequences that `maker` makes later, in migrations to come.
GIVE = "ALTER DEFAULT PRIVILEGES FOR ROLE {maker} IN SCHEMA {schema} GRANT "
OF_LATER_ONES = (
    ("SELECT ON TABLES", "{reader}"),
    ("SELECT ON SEQUENCES", "{reader}"),
    ("SELECT, INSERT, UPDATE ON TABLES", "{operator}"),
    ("USAGE, SELECT ON SEQUENCES", "{operator}"),
    ("ALL ON TABLES", "{admin}"),
    ("ALL ON SEQUENCES", "{admin}"),
)
LOGIN = text(
    "SELECT current_user, rolsuper OR rolcreaterole, rolsuper FROM pg_roles "
    "WHERE rolname = current_user"
)


def names_in(connection: Connection) -> dict[str, Any]:
    """All names of the statements, quoted.

    Parameters:
        connection: A connection to a store on PostgreSQL, whose tables are listed.

    Returns:
        What `psycopg.sql` puts into a statement, by the key in its braces.
    """
    from psycopg.sql import SQL

    def listed(tables: list[str]) -> Any:
        return SQL(", ").join(identifier(table) for table in tables)

    there = tables_of(connection)
    named = {
        "reader": READER,
        "operator": OPERATOR,
        "admin": ADMIN,
        "version": VERSION,
    }
    named["schema"] = str(connection.scalar(text("SELECT current_schema()")))
    return {
        **{key: identifier(name) for key, name in named.items()},
        "tables": listed(there),
        "append_only": listed(
            [table for table in there if table in (*APPEND_ONLY, *CHANGED_COLUMNS)]
        ),
    }


def identifier(name: str) -> Any:
    """A name as PostgreSQL quotes it in a statement.

    Parameters:
        name: The name of a role, a schema, a table or a column, without quotes.
    """
    from psycopg.sql import Identifier

    return Identifier(name)


def run(connection: Connection, statement: str, names: dict[str, Any]) -> None:
    """Executes a statement with quoted names.

    Parameters:
        connection: A connection to a store on PostgreSQL.
        statement: The statement, with a key in braces for each name.
        names: The quoted names by key, as `names_in` gives them.
    """
    from psycopg.sql import SQL

    connection.exec_driver_sql(SQL(statement).format(**names).as_string())


#: SQLSTATE of a role that another transaction has made meanwhile: duplicate_object,
#: unique_violation.
_MADE_BY_ANOTHER = ("42710", "23505")

_OWNER = text(
    "SELECT tableowner FROM pg_tables WHERE schemaname = current_schema() AND tablename = :table"
)
_MEMBER = text("SELECT pg_has_role(current_user, CAST(:role AS name), :how)")
_MAKES_TABLES = text("SELECT has_schema_privilege(CAST(:role AS name), current_schema(), 'CREATE')")


def grant_roles(connection: Connection) -> bool:
    """Make the roles that the server lacks, and give each its rights in this store, whose tables
    become the admin's.

    May be run again: what is there stays.

    Parameters:
        connection: A connection to a store on PostgreSQL, within a transaction.

    Returns:
        False where a role is missing and the login may not make one (it lacks CREATEROLE), and
        nothing is granted then; else True.
    """
    _act_as_login(connection)
    _, may_make, is_super = connection.execute(LOGIN).one()
    missing = missing_roles(connection)
    if missing and not may_make:
        return False
    for role in missing:
        _make(connection, role, joined=role == ADMIN and not is_super)
    names = names_in(connection)
    for statement in (*OF_THE_SCHEMA, *OF_THE_SEQUENCES):
        run(connection, statement, names)
    grant_rights(connection)
    for maker in _makers(connection):
        for rights, role in OF_LATER_ONES:
            run(connection, f"{GIVE}{rights} TO {role}", names | maker)
    if _may_act_as_admin(connection) and connection.scalar(_MAKES_TABLES, {"role": ADMIN}):
        _hand_over(connection, names)
    return True


def grant_rights(connection: Connection) -> None:
    """Give each role, which must be there, its rights on the store's tables and functions, and no
    more.

    Parameters:
        connection: A connection to a store on PostgreSQL, within a transaction.
    """
    names = names_in(connection)
    for statement in OF_THE_TABLES:
        run(connection, statement, names)
    for table in tables_of(connection):
        named = names | {"table": identifier(table)}
        if table in PEOPLE:
            run(connection, "REVOKE INSERT, UPDATE ON TABLE {table} FROM {operator}", named)
        if table in SECRET_TABLES:
            run(connection, "REVOKE ALL ON TABLE {table} FROM {reader}", named)
        if table in DELETED_FROM:
            run(connection, "GRANT DELETE ON TABLE {table} TO {operator}", named)
        for column in changed_columns(connection, table):
            own = named | {"column": identifier(column)}
            run(connection, "GRANT UPDATE ({column}) ON TABLE {table} TO {operator}", own)
    for function in functions_of(connection):
        run(
            connection,
            f"REVOKE ALL ON FUNCTION {{schema}}.{function} FROM PUBLIC, {{reader}}",
            names,
        )
        run(
            connection,
            f"GRANT EXECUTE ON FUNCTION {{schema}}.{function} TO {{operator}}, {{admin}}",
            names,
        )


def owns(connection: Connection) -> bool:
    """Whether the login, or a role it is a member of, owns the store: another's grants have no
    effect.

    Parameters:
        connection: A connection to a store on PostgreSQL.
    """
    owner = connection.scalar(_OWNER, {"table": VERSION})
    return owner is None or bool(connection.scalar(_MEMBER, {"role": owner, "how": "USAGE"}))


def act_as_owner(connection: Connection) -> None:
    """Where the tables are the admin's, be the admin for this transaction: what it makes is the
    admin's, too.

    Parameters:
        connection: A connection to a store on PostgreSQL, within a transaction.
    """
    if connection.scalar(_OWNER, {"table": VERSION}) == ADMIN and _may_act_as_admin(connection):
        run(connection, "SET LOCAL ROLE {admin}", {"admin": identifier(ADMIN)})


def _act_as_login(connection: Connection) -> None:
    connection.execute(text("SET LOCAL ROLE NONE"))


def _make(connection: Connection, role: str, *, joined: bool) -> None:
    """`joined`: the login becomes a member. Another store of the server may be making the role at
    this moment."""
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


def _hand_over(connection: Connection, names: dict[str, Any]) -> None:
    """The admin's role becomes the owner. Sequences and indexes go with their tables; the functions
    act as their owner."""
    for table in tables_of(connection):
        run(
            connection,
            "ALTER TABLE {table} OWNER TO {admin}",
            names | {"table": identifier(table)},
        )
    for function in functions_of(connection):
        run(connection, f"ALTER FUNCTION {{schema}}.{function} OWNER TO {{admin}}", names)


#: What each role is for, in a person's words.
MAY = {
    READER: "look: lists, exports, predictions, reports",
    OPERATOR: "and work: ingest, plan, train, diagnose",
    ADMIN: "and upgrade the store, whose tables it owns",
}
_MEMBERS = text(
    "SELECT granted.rolname, member.rolname FROM pg_auth_members JOIN pg_roles granted ON "
    "granted.oid = roleid JOIN pg_roles member ON member.oid = pg_auth_members.member ORDER BY "
    "member.rolname"
)


@dataclass(frozen=True)
class Role:
    """A role of the server, what it may do in a store, and the logins that have it."""

    name: str
    may: str
    members: tuple[str, ...]


def ensure_roles(engine: Engine) -> list[Role]:
    """Make the roles that are missing and grant what they lack, in one transaction; safe to repeat.

    Parameters:
        engine: The engine of the store.

    Returns:
        All roles, with the logins that have them.

    Raises:
        StoreRoleError: For a login that does not own the store.
        StoreError: Where there are no roles (SQLite), or the login may not make them.
    """
    if engine.dialect.name != "postgresql":
        raise StoreError(
            f"{describe(engine)} has no roles: whoever may write the file may "
            f"do all (chmod, or PostgreSQL)"
        )
    try:
        with engine.begin() as connection:
            if not owns(connection):
                raise StoreRoleError(
                    f"{describe(engine)}: only its owner grants; this needs the role {ADMIN}"
                )
            if not grant_roles(connection):
                raise StoreError(
                    f"{describe(engine)}: {how_to_make_roles(missing_roles(connection))}"
                )
            if lacking := missing_rights(connection):
                raise StoreError(
                    f"{describe(engine)}: not granted: "
                    f"{', '.join(lacking)}; is another their owner?"
                )
            return _roles(connection)
    except DBAPIError as error:
        raise refusal(engine, error) from error


def without_roles(engine: Engine) -> str | None:
    """What to tell who has just made or upgraded a store whose roles could not be made; None where
    all is well.

    Parameters:
        engine: The engine of the store. One of SQLite has no roles, and gives None.
    """
    if engine.dialect.name != "postgresql":
        return None
    with engine.connect() as connection:
        missing = missing_roles(connection)
    return how_to_make_roles(missing) if missing else None


def how_to_make_roles(missing: list[str]) -> str:
    """The next step of a login that may not make roles.

    Parameters:
        missing: The names of the roles that the server lacks.
    """
    return (
        f"the server has no role {', '.join(missing)}, and this login may not "
        f"make one: with a login that has "
        "CREATEROLE, or after CREATE ROLE by an administrator, run pyroshock db roles"
    )


def _roles(connection: Connection) -> list[Role]:
    rows = connection.execute(_MEMBERS).all()
    return [
        Role(name, MAY[name], tuple(member for role, member in rows if role == name))
        for name in ROLES
    ]
