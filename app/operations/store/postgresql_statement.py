"""What a statement would call and read on PostgreSQL, as the server itself understands it, before
any of it runs.

A READ ONLY transaction changes no row, and still runs functions that end other sessions, take
locks, read files of the server or leave the transaction's settings. Which functions a text calls
only the server's own parser can tell: quoted names, operators, views and casts hide them. Hence the
server parses the statement (PostgreSQL's extended protocol, message Parse, which runs nothing) and
gives its tree with `debug_print_rewritten`, in which views are expanded and every function and
table stands with its number in the catalogue. The numbers are held against what a question needs.
"""

from __future__ import annotations

import re
from collections.abc import Collection
from typing import Any

#: Fields of the tree that hold the number of a function (src/include/nodes/primnodes.h,
#: parsenodes.h).
_CALLED = re.compile(
    r":(?:funcid|opfuncid|aggfnoid|winfnoid|hashfuncid|negfuncid|elemfuncid|tsmhandler|"
    r"startInRangeFunc|endInRangeFunc)"
    r"\s+(\S+)"  # the server breaks long lines
)
_READ = re.compile(r":relid\s+(\S+)")
_COMMAND = re.compile(r":commandType\s+(\S+)")
_SELECT = "1"

#: Functions that may give another answer each time and touch nothing. All others of that kind are
#: refused: they are how sessions are ended, locks taken, files read and settings changed.
_HARMLESS_VOLATILE = ("random", "clock_timestamp", "timeofday", "gen_random_uuid")
#: What the functions that describe the server are called, but for two that describe a value.
_HARMLESS_OF_SERVER = ("pg_typeof", "pg_column_size")
#: Functions outside this rule that read tables by their name (table_to_xml), or settings.
_FORBIDDEN_FUNCTIONS = """
SELECT format('%%I.%%I', pronamespace::regnamespace::text, proname) FROM pg_catalog.pg_proc
WHERE oid = ANY (%s) AND NOT (
  pronamespace = 'pg_catalog'::regnamespace
  AND (provolatile <> 'v' OR proname = ANY (%s))
  AND (proname !~ '^pg_' OR proname = ANY (%s))
  AND proname !~ '_to_xml|^current_setting$|^ts_stat$|^ts_rewrite$|^has_.*_privilege$|^txid_'
) ORDER BY 1 LIMIT 1
"""
_FORBIDDEN_TABLES = """
SELECT format('%%I.%%I', relnamespace::regnamespace::text, relname) FROM pg_catalog.pg_class
WHERE oid = ANY (%s) AND relnamespace <> pg_catalog.current_schema()::regnamespace
ORDER BY 1 LIMIT 1
"""
_HIDDEN_TABLES = """
SELECT relname FROM pg_catalog.pg_class WHERE oid = ANY (%s) AND relname = ANY (%s)
ORDER BY 1 LIMIT 1
"""
_READER_OF_THE_STORE = """
SELECT rolname FROM pg_catalog.pg_roles WHERE rolname = %s AND pg_catalog.pg_has_role(rolname, %s)
AND pg_catalog.has_table_privilege(rolname, %s, 'SELECT')
"""


class ForbiddenStatementError(Exception):
    """A statement that is no question to the store: it `changes` something, or `subject` is what it
    would touch; `hidden`: a table of the store that is not read so."""

    def __init__(self, subject: str, *, changes: bool = False, hidden: bool = False) -> None:
        super().__init__(subject)
        self.subject, self.changes, self.hidden = subject, changes, hidden


def check_statement(connection: Any, sql: str, hidden: Collection[str] = ()) -> None:
    """Raises `ForbiddenStatementError`, or psycopg's error for a text that the server cannot parse.

    `connection`: of psycopg, within a transaction, which stays open and keeps its settings.
    """
    trees = _trees(connection, sql)
    tree = "".join(trees)
    commands = set(_COMMAND.findall(tree))
    if not trees or commands != {_SELECT}:
        raise ForbiddenStatementError("a change of the store", changes=True)
    called, read = (sorted(_numbers(field.findall(tree))) for field in (_CALLED, _READ))
    function = connection.execute(
        _FORBIDDEN_FUNCTIONS, [called, list(_HARMLESS_VOLATILE), list(_HARMLESS_OF_SERVER)]
    ).fetchone()
    if function is not None:
        raise ForbiddenStatementError(f"the function {function[0].removeprefix('pg_catalog.')}")
    table = connection.execute(_FORBIDDEN_TABLES, [read]).fetchone()
    if table is not None:
        raise ForbiddenStatementError(f"{table[0]} (no table of the store)")
    table = connection.execute(_HIDDEN_TABLES, [read, list(hidden)]).fetchone()
    if table is not None:
        raise ForbiddenStatementError(table[0], hidden=True)


def _numbers(values: list[str]) -> set[int]:
    """A value that is no number is the text of a name, or a tree of a form that is not known:
    refused."""
    values = [value.rstrip(")}") for value in values]
    unknown = next((value for value in values if not value.isdecimal()), None)
    if unknown is not None:
        raise ForbiddenStatementError(f"a name like {unknown!r}")
    return {int(value) for value in values}


def become_reader(connection: Any, role: str, table: str) -> None:
    """For the rest of the transaction, have no more rights than the store's readers, where the
    login may be one."""
    from psycopg.sql import SQL, Identifier

    how = "SET" if connection.info.server_version >= 160_000 else "MEMBER"
    if connection.execute(_READER_OF_THE_STORE, [role, how, table]).fetchone() is not None:
        connection.execute(SQL("SET LOCAL ROLE {}").format(Identifier(role)))


def _trees(connection: Any, sql: str) -> list[str]:
    """The rewritten trees of one statement."""
    from psycopg.errors import error_from_result
    from psycopg.pq import ExecStatus

    trees: list[str] = []

    def keep(notice: Any) -> None:
        if notice.message_detail is not None:
            trees.append(notice.message_detail)

    connection.execute("SET LOCAL debug_pretty_print = off")
    connection.execute("SET LOCAL client_min_messages = log")
    connection.execute("SET LOCAL debug_print_rewritten = on")
    connection.add_notice_handler(keep)
    try:
        result = connection.pgconn.prepare(b"", sql.encode(connection.info.encoding))
    finally:
        connection.remove_notice_handler(keep)
    if result.status != ExecStatus.COMMAND_OK:
        raise error_from_result(result, connection.info.encoding)
    connection.execute("SET LOCAL debug_print_rewritten = off")
    connection.execute("SET LOCAL client_min_messages = warning")
    return trees
