"""The statements by which PostgreSQL's roles get their rights. They take no parameters: `psycopg.sql` quotes the names
that they hold.
"""

from __future__ import annotations

from typing import Any

from sqlalchemy import Connection, text

from .permissions import ADMIN, DELETED_FROM, NEVER_CHANGED, OPERATOR, READER, VERSION, tables_of

OF_THE_SCHEMA = (
    "GRANT USAGE ON SCHEMA {schema} TO {reader}, {operator}, {admin}",
    "GRANT CREATE ON SCHEMA {schema} TO {admin}",
)
OF_THE_TABLES = (
    "GRANT SELECT ON TABLE {tables} TO {reader}",
    "GRANT SELECT, INSERT, UPDATE ON TABLE {tables} TO {operator}",
    "GRANT DELETE ON TABLE {deleted_from} TO {operator}",
    "REVOKE UPDATE ON TABLE {never_changed} FROM {operator}",
    "REVOKE INSERT, UPDATE ON TABLE {version} FROM {operator}",
    "GRANT ALL ON TABLE {tables} TO {admin}",
    "GRANT SELECT ON ALL SEQUENCES IN SCHEMA {schema} TO {reader}",
    "GRANT USAGE, SELECT ON ALL SEQUENCES IN SCHEMA {schema} TO {operator}",
    "GRANT ALL ON ALL SEQUENCES IN SCHEMA {schema} TO {admin}",
)
#: Of tables and sequences that `maker` makes later, in migrations to come.
GIVE = "ALTER DEFAULT PRIVILEGES FOR ROLE {maker} IN SCHEMA {schema} GRANT "
TAKE = "ALTER DEFAULT PRIVILEGES FOR ROLE {maker} IN SCHEMA {schema} REVOKE "
OF_LATER_ONES = (
    ("SELECT ON TABLES", "{reader}"),
    ("SELECT ON SEQUENCES", "{reader}"),
    ("SELECT, INSERT, UPDATE ON TABLES", "{operator}"),
    ("USAGE, SELECT ON SEQUENCES", "{operator}"),
    ("ALL ON TABLES", "{admin}"),
    ("ALL ON SEQUENCES", "{admin}"),
)
TAKE_ALL = (
    "REVOKE ALL ON ALL TABLES IN SCHEMA {schema} FROM {reader}, {operator}, {admin}",
    "REVOKE ALL ON ALL SEQUENCES IN SCHEMA {schema} FROM {reader}, {operator}, {admin}",
    "REVOKE ALL ON SCHEMA {schema} FROM {reader}, {operator}, {admin}",
)
LOGIN = text("SELECT current_user, rolsuper OR rolcreaterole, rolsuper FROM pg_roles WHERE rolname = current_user")


def names_in(connection: Connection) -> dict[str, Any]:
    """All names of the statements, quoted."""
    from psycopg.sql import SQL

    def listed(tables: list[str]) -> Any:
        return SQL(", ").join(identifier(table) for table in tables)

    there = tables_of(connection)
    login, *_ = connection.execute(LOGIN).one()
    named = {"reader": READER, "operator": OPERATOR, "admin": ADMIN, "login": login, "version": VERSION}
    named["schema"] = str(connection.scalar(text("SELECT current_schema()")))
    return {
        **{key: identifier(name) for key, name in named.items()},
        "tables": listed(there),
        "deleted_from": listed([table for table in there if table in DELETED_FROM]),
        "never_changed": listed([table for table in there if table in NEVER_CHANGED]),
    }


def identifier(name: str) -> Any:
    from psycopg.sql import Identifier

    return Identifier(name)


def run(connection: Connection, statement: str, names: dict[str, Any]) -> None:
    from psycopg.sql import SQL

    connection.exec_driver_sql(SQL(statement).format(**names).as_string())
