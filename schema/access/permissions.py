"""What each role may do in a store on PostgreSQL, and what a database refuses, in words: where a
login lacks a role, which one. A file of SQLite is its owner's, whole."""

from __future__ import annotations

import re

from sqlalchemy import Connection, Engine, func, select, text
from sqlalchemy.exc import DBAPIError

from ..engine import StoreError, StoreRoleError, describe, first_line
from ..tables import metadata
from ..users import SECRET_TABLES

READER, OPERATOR, ADMIN = ROLES = ("pyroshock_reader", "pyroshock_operator", "pyroshock_admin")

#: Where Alembic keeps the revision.
VERSION = "alembic_version"
#: Rows of these are added and stay as they are, for every role but the admin: recordings, their
#: calibration and samples, what the checks said of them, the content of attached files, who wrote
#: what, and predictions of runs. Where the software itself must change one as an operator, a
#: function does it that looks whether it may (`append_only.py`).
APPEND_ONLY = (
    *("recordings", "channels", "series_chunks", "quality_findings", "provenance"),
    *("audit_rows", "notes", "attached_contents", "attached_pieces", "run_predictions"),
)
#: People, and what they sign in with: an operator's login looks them up, and the admin's alone
#: writes them. The hashes are nothing for a reader's.
PEOPLE = ("users", *SECRET_TABLES, "sign_on_identities")
#: Of these an operator changes some columns: hits are linked to their plan and to corrected
#: settings, pulses are taken into use, a campaign's bench is completed, an attachment is removed or
#: restored. To which recording and campaign they belong, and their figures, stay.
_BY_SOFTWARE = ("written_by_id", "row_sha256")
CHANGED_COLUMNS = {
    "impacts": ("planned_run_id", "configuration_id", *_BY_SOFTWARE),
    "shots": ("planned_run_id", "configuration_id", *_BY_SOFTWARE),
    "pulses": ("current", *_BY_SOFTWARE),
    "attachments": (
        *("removed_at", "removed_by", "removed_by_kind", "removal_reason"),
        *_BY_SOFTWARE,
    ),
    "campaigns": ("fingerprint", "gun_id", "hammer_id", "plate_id", "known_facts", *_BY_SOFTWARE),
}
#: Figures that are computed from the samples, and replaced when they are computed anew; versions
#: of models that are deleted in their registry; tags and saved filters that nobody wants; and
#: pictures of the first page, which are ordered anew.
DELETED_FROM = (
    *("channel_figures", "registered_versions", "tags", "saved_filters", "home_pictures"),
)
#: Functions of the store that an operator may call, with the types of their arguments.
FUNCTIONS = (
    "pyroshock_delete_set_aside(integer)",
    "pyroshock_replace_set_aside(integer, text, bigint, text, text, text, integer, text)",
    "pyroshock_delete_damaged_chunks(integer)",
    "pyroshock_withdraw_force_sign(integer)",
)

_THE_TABLES = text("SELECT tablename FROM pg_tables WHERE schemaname = current_schema()")
_THE_COLUMNS = text(
    "SELECT column_name FROM information_schema.columns WHERE table_schema = "
    "current_schema() AND table_name = :table"
)
_THE_FUNCTION = text(
    "SELECT to_regprocedure(quote_ident(current_schema()) || '.' || :function) IS NOT NULL"
)
_THE_ROLES = text("SELECT rolname FROM pg_roles WHERE rolname LIKE 'pyroshock%'")


def tables_of(connection: Connection) -> list[str]:
    """The store's own tables that are there, and Alembic's; not what else may lie in the same
    database."""
    return sorted({VERSION, *metadata.tables} & set(connection.scalars(_THE_TABLES)))


def missing_roles(connection: Connection) -> list[str]:
    """Roles that the server does not have."""
    existing_roles = set(connection.scalars(_THE_ROLES))
    return [role for role in ROLES if role not in existing_roles]


def missing_rights(connection: Connection) -> list[str]:
    """What a role should be able to do and cannot, as "pyroshock_reader: SELECT on impacts"."""
    wanted = [
        (role, table, right) for table in tables_of(connection) for role, right in rights_on(table)
    ]
    held = connection.execute(
        select(*(func.has_table_privilege(*privilege) for privilege in wanted))
    ).one()
    lacking = [
        f"{role}: {right} on {table}"
        for (role, table, right), has in zip(wanted, held, strict=True)
        if not has
    ]
    columns = [
        (table, column)
        for table in tables_of(connection)
        for column in changed_columns(connection, table)
    ]
    for table, column in columns:
        if not connection.scalar(
            select(func.has_column_privilege(OPERATOR, table, column, "UPDATE"))
        ):
            lacking += [f"{OPERATOR}: UPDATE of {column} in {table}"]
    for function in functions_of(connection):
        if not connection.scalar(
            select(func.has_function_privilege(OPERATOR, function, "EXECUTE"))
        ):
            lacking += [f"{OPERATOR}: EXECUTE on {function}"]
    return lacking


def functions_of(connection: Connection) -> list[str]:
    """The store's own functions that are there."""
    return [
        function
        for function in FUNCTIONS
        if connection.scalar(_THE_FUNCTION, {"function": function})
    ]


def changed_columns(connection: Connection, table: str) -> list[str]:
    """Columns that an operator may change, where it may not change all of them; those that the
    table has by now."""
    existing = (
        set(connection.scalars(_THE_COLUMNS, {"table": table}))
        if table in CHANGED_COLUMNS
        else set()
    )
    return [column for column in CHANGED_COLUMNS.get(table, ()) if column in existing]


def rights_on(table: str) -> list[tuple[str, str]]:
    """(role, right) of each role on a table."""
    operator = {"SELECT", "INSERT", "UPDATE"}
    if table in (*APPEND_ONLY, *CHANGED_COLUMNS):
        operator -= {"UPDATE"}
    if table in (VERSION, *PEOPLE):
        operator = {"SELECT"}
    if table in DELETED_FROM:
        operator |= {"DELETE"}
    admin = ("SELECT", "INSERT", "UPDATE", "DELETE")
    return [
        *([] if table in SECRET_TABLES else [(READER, "SELECT")]),
        *((OPERATOR, right) for right in sorted(operator)),
        *((ADMIN, r) for r in admin),
    ]


#: SQLSTATE insufficient_privilege: "permission denied for table ..", "must be owner of table ..".
_DENIED = "42501"
#: First words of statements that an operator may use; others change tables.
_CHANGE_ROWS = ("INSERT", "UPDATE", "DELETE")


def refusal(engine: Engine, error: DBAPIError, subject: str | None = None) -> StoreError:
    """The error to raise for a driver's; `subject` is what it says it of, else the store's
    address."""
    message = f"{subject or describe(engine)}: {first_line(error)}"
    role = needed_role(error)
    if role is None:
        return StoreError(message)
    login = engine.url.username or "LOGIN"
    return StoreRoleError(
        f'{message}; this needs the role {role}: an administrator runs GRANT {role} TO "{login}"'
    )


def needed_role(error: DBAPIError) -> str | None:
    """The role that a refused statement needs; None where it was refused for another reason."""
    if getattr(error.orig, "sqlstate", None) != _DENIED:
        return None
    statement = error.statement or ""
    words = statement.split() or [""]
    named = set(re.findall(r"\w+", statement))
    if named & {*PEOPLE} and words[0].upper() in _CHANGE_ROWS:
        return ADMIN
    if words[0].upper() == "SELECT":
        if named & {*SECRET_TABLES}:
            return OPERATOR
        # a key is reserved before its row is inserted
        words_of_writers = (
            "FOR UPDATE",
            "nextval",
            *(name.partition("(")[0] for name in FUNCTIONS),
        )
        writes = any(word in statement for word in words_of_writers)
        return OPERATOR if writes else READER
    if words[:2] == ["DELETE", "FROM"] and words[2] not in DELETED_FROM:
        return ADMIN
    if words[0] == "UPDATE" and words[1] in (*APPEND_ONLY, *CHANGED_COLUMNS):
        return ADMIN
    return OPERATOR if words[0].upper() in _CHANGE_ROWS and VERSION not in words else ADMIN
