"""One statement asked of the store through a connection that cannot change it, its rows in batches;
and the tables of the store with units, for people who write SQL.

SQLite: the file is opened with mode=ro and query_only, and an authorizer refuses everything but
reading, ATTACH and PRAGMA included. PostgreSQL: a READ ONLY transaction with a statement timeout,
with the rights of a reader where the login may have them, and with the functions and tables alone
that a question needs (postgresql_statement.py). Parameters are bound by the driver and never become
part of the text.
"""

from __future__ import annotations

import re
import sqlite3
import time
from collections.abc import Collection, Iterator, Mapping
from contextlib import closing, contextmanager
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from sqlalchemy import Engine

from ....schema.access.permissions import READER
from ....schema.base import Base
from ....schema.tables import metadata
from ....schema.users import SECRET_TABLES
from ...common.unit_endings import unit_ending
from .postgresql_statement import ForbiddenStatementError, become_reader, check_statement

#: What is no code: quoted text and names, comments; then casts (`::`) and parameters (`:name`).
_TOKENS = re.compile(
    r"(?P<quoted>'(?:[^']|'')*'|\"(?:[^\"]|\"\")*\")"
    r"|(?P<comment>--[^\n]*|/\*.*?\*/)"
    r"|(?P<cast>::)"
    r"|:(?P<parameter>[A-Za-z_]\w*)",
    re.DOTALL,
)
_WORD = re.compile(r"[A-Za-z_]\w*")

#: First words of statements that only read.
READING = ("SELECT", "WITH", "VALUES")

#: The command that does what a refused statement would do.
_INSTEAD = {
    "INSERT": "new rows come with `pyroshock ingest FOLDER`",
    "REPLACE": "a corrected recording comes with `pyroshock runs replace`",
    "UPDATE": "a corrected recording comes with `pyroshock runs replace`",
    "DELETE": "use `pyroshock campaigns delete` or `pyroshock runs discard`",
    "CREATE": "tables change with `pyroshock db upgrade`",
    "ALTER": "tables change with `pyroshock db upgrade`",
    "DROP": "use `pyroshock campaigns delete` for a campaign; tables change with "
    "`pyroshock db upgrade`",
    "ATTACH": "copy a store with `pyroshock db copy`",
    "VACUUM": "copy a store with `pyroshock db copy`",
    "PRAGMA": "`pyroshock query --tables` and `--schema TABLE` list what there is",
    "EXPLAIN": "open the database with its own program for that",
}


class QueryError(ValueError):
    """A statement that cannot be run, or was refused; the message says why and what to do."""


def refusal(word: str) -> QueryError:
    """The error for a statement, or a part of one, that is no question."""
    instead = _INSTEAD.get(word.upper(), "begin the statement with SELECT, WITH or VALUES")
    return QueryError(
        f"query reads and does not change the store, so {word.upper()} is refused; {instead}"
    )


@dataclass(frozen=True)
class Statement:
    """SQL with named parameters (`:name`) and their values as text."""

    sql: str
    parameters: Mapping[str, str]

    def check(self) -> None:
        """Raises `QueryError` where the first word does not begin a question, or parameters do not
        fit."""
        words = _WORD.search(self._code())
        if words is None:
            raise QueryError(
                'the statement is empty; for example: pyroshock query "select name from campaigns"'
            )
        if words[0].upper() not in READING:
            raise refusal(words[0])
        named = self.names()
        missing = [name for name in named if name not in self.parameters]
        if missing:
            raise QueryError(
                f"no value for :{', :'.join(missing)}; give it with -p {missing[0]} VALUE"
            )
        unused = [name for name in self.parameters if name not in named]
        if unused:
            names = ", ".join(f":{name}" for name in named) or "none"
            raise QueryError(
                f"-p {unused[0]}: the statement has no :{unused[0]}; its parameters: {names}"
            )

    def names(self) -> list[str]:
        """Parameters in the order in which they first appear."""
        parameters = (
            token["parameter"] for token in _TOKENS.finditer(self.sql) if token["parameter"]
        )
        return list(dict.fromkeys(parameters))

    def words(self) -> list[str]:
        """Names and keywords of the statement, without quoted text."""
        return _WORD.findall(self._code())

    def _code(self) -> str:
        return _TOKENS.sub(lambda token: token[0] if token["cast"] else " ", self.sql)

    def for_sqlite(self) -> tuple[str, dict[str, str | int | float]]:
        """SQL and values: a number where its shortest text is what was typed, so that "007" stays a
        name."""
        return self.sql, {name: _number_or_text(text) for name, text in self.parameters.items()}

    def for_postgresql(self) -> tuple[str, list[str]]:
        """SQL with $1, $2 and the values in this order, as text, whose type the server takes from
        where it stands."""
        names = self.names()

        def numbered(token: re.Match[str]) -> str:
            return f"${names.index(token['parameter']) + 1}" if token["parameter"] else token[0]

        return _TOKENS.sub(numbered, self.sql), [self.parameters[name] for name in names]


def _number_or_text(text: str) -> str | int | float:
    for kind in (int, float):
        try:
            number = kind(text)
        except ValueError:
            continue
        if repr(number) == text:
            return number
    return text


Batch = dict[str, list[Any]]

#: Rows that are fetched together.
ROWS = 5_000

#: SQLite looks this often (in steps of its virtual machine, about a millisecond) whether its time
#: is over.
_STEPS = 100_000

_READS = frozenset(
    (sqlite3.SQLITE_SELECT, sqlite3.SQLITE_READ, sqlite3.SQLITE_FUNCTION, sqlite3.SQLITE_RECURSIVE)
)
_ACTIONS = {
    sqlite3.SQLITE_INSERT: "INSERT",
    sqlite3.SQLITE_UPDATE: "UPDATE",
    sqlite3.SQLITE_DELETE: "DELETE",
    sqlite3.SQLITE_PRAGMA: "PRAGMA",
    sqlite3.SQLITE_ATTACH: "ATTACH",
}
_CHANGES = ("INSERT", "UPDATE", "DELETE", "MERGE")
_UNKNOWN_TABLE = re.compile(r'no such table: (?:main\.)?(\S+)|relation "([^"]+)" does not exist')
_UNKNOWN_COLUMN = re.compile(
    r'no such column: (?:\w+\.)?(\w+)|column (?:\w+\.)?"?(\w+)"? does not exist'
)


@contextmanager
def run_statement(
    engine: Engine, statement: Statement, timeout_s: float, hidden: Collection[str] = SECRET_TABLES
) -> Iterator[Iterator[Batch]]:
    """Gives the answer in batches of columns; the first batch has the columns also where there are
    no rows. A statement that reads a `hidden` table is refused.

    Bytes are shown as their size, two columns of one name as `name` and `name_2`. Raises
    `QueryError`.
    """
    statement.check()
    sqlite = engine.dialect.name == "sqlite"
    with (_sqlite if sqlite else _postgresql)(engine, statement, timeout_s, hidden) as batches:
        yield batches


@contextmanager
def _sqlite(
    engine: Engine, statement: Statement, timeout_s: float, hidden: Collection[str]
) -> Iterator[Iterator[Batch]]:
    path = Path(engine.url.database or "").absolute()
    denied: list[int] = []
    hidden_read: list[str] = []

    def authorized(action: int, first: str | None, second: str | None, *_: str | None) -> int:
        # SQLite takes names of tables in any case, and gives the one that they were made with.
        if action == sqlite3.SQLITE_READ and first in hidden:
            hidden_read.append(str(first))
            return sqlite3.SQLITE_DENY
        if action in _READS and second != "load_extension":
            return sqlite3.SQLITE_OK
        denied.append(action)
        return sqlite3.SQLITE_DENY

    with closing(sqlite3.connect(f"{path.as_uri()}?mode=ro", uri=True)) as connection:
        connection.execute("PRAGMA query_only = ON")
        connection.set_authorizer(authorized)
        end = time.monotonic() + timeout_s
        connection.set_progress_handler(lambda: time.monotonic() > end, _STEPS)

        def explained(error: Exception) -> QueryError:
            if hidden_read:
                return _hidden(hidden_read[0])
            if denied:
                return refusal(_ACTIONS.get(denied[0], statement.words()[0]))
            if getattr(error, "sqlite_errorcode", None) == sqlite3.SQLITE_INTERRUPT:
                return _too_long(timeout_s)
            return _explained(str(error), statement)

        try:
            cursor = connection.execute(*statement.for_sqlite())
        except (sqlite3.Error, sqlite3.Warning) as error:
            raise explained(error) from error

        def batches() -> Iterator[Batch]:
            try:
                yield from _batches(cursor)
            except sqlite3.Error as error:
                raise explained(error) from error

        yield batches()


@contextmanager
def _postgresql(
    engine: Engine, statement: Statement, timeout_s: float, hidden: Collection[str]
) -> Iterator[Iterator[Batch]]:
    import psycopg
    from psycopg.types.numeric import FloatLoader
    from psycopg.types.string import TextLoader

    def explained(error: psycopg.Error) -> QueryError:
        if error.sqlstate == "57014":
            return _too_long(timeout_s)
        if error.sqlstate == "25006":
            return _refused_change(statement)
        return _explained(str(error).splitlines()[0], statement)

    pooled = engine.raw_connection()
    try:
        connection: Any = pooled.driver_connection
        connection.rollback()
        connection.read_only = True
        connection.adapters.register_loader("numeric", FloatLoader)
        for name in ("json", "jsonb"):  # as SQLite gives it
            connection.adapters.register_loader(name, TextLoader)
        connection.execute(
            "SELECT set_config('statement_timeout', %s, true)", [f"{1000 * timeout_s:.0f}"]
        )
        become_reader(connection, READER, metadata.tables["campaigns"].name)
        sql, values = statement.for_postgresql()
        with psycopg.RawServerCursor(connection, "pyroshock_query") as cursor:
            try:
                check_statement(connection, sql, hidden)
                cursor.execute(sql, values)
            except ForbiddenStatementError as error:
                raise _forbidden(error, statement) from error
            except psycopg.Error as error:
                raise explained(error) from error

            def batches() -> Iterator[Batch]:
                try:
                    yield from _batches(cursor)
                except psycopg.Error as error:
                    raise explained(error) from error

            try:
                yield batches()
            finally:
                connection.rollback()
    finally:
        pooled.invalidate()  # with its settings it must not serve others


def _forbidden(error: ForbiddenStatementError, statement: Statement) -> QueryError:
    if error.changes:
        return _refused_change(statement)
    if error.hidden:
        return _hidden(error.subject)
    return QueryError(
        f"query reads the tables of the store, so {error.subject} is refused; "
        f"ask the database with psql"
    )


def _hidden(table: str) -> QueryError:
    if table in SECRET_TABLES:
        return QueryError(f"query does not read {table}, by which people sign in")
    return QueryError(
        f"query does not read {table} for this person; an administrator and an engineer may, or "
        "whoever works on the command line"
    )


def _refused_change(statement: Statement) -> QueryError:
    changes = [word for word in statement.words() if word.upper() in _CHANGES]
    return refusal(changes[0] if changes else "a change of the store")


def _batches(cursor: Any) -> Iterator[Batch]:
    names = _unique([column[0] for column in cursor.description])
    rows = cursor.fetchmany(ROWS)
    yield (
        dict(zip(names, map(_printable_values, zip(*rows, strict=True)), strict=True))
        if rows
        else {name: [] for name in names}
    )
    while rows := cursor.fetchmany(ROWS):
        yield dict(zip(names, map(_printable_values, zip(*rows, strict=True)), strict=True))


def _printable_values(column: tuple[Any, ...]) -> list[Any]:
    if bytes in set(map(type, column)):
        return [f"<{len(value)} bytes>" if isinstance(value, bytes) else value for value in column]
    return list(column)


def _unique(names: list[str]) -> list[str]:
    counts: dict[str, int] = {}
    unique: list[str] = []
    for name in names:
        counts[name] = counts.get(name, 0) + 1
        unique.append(name if counts[name] == 1 else f"{name}_{counts[name]}")
    return unique


def _too_long(timeout_s: float) -> QueryError:
    return QueryError(
        f"the statement took longer than {timeout_s:g} s and was stopped; "
        f"narrow it, or give --timeout"
    )


def _explained(text: str, statement: Statement) -> QueryError:
    """A driver's error with what there is instead of an unknown table or column."""
    if table := _UNKNOWN_TABLE.search(text):
        name = table[1] or table[2]
        return QueryError(
            f"no table {name!r} in the store; tables: {', '.join(sorted(metadata.tables))}"
        )
    if column := _UNKNOWN_COLUMN.search(text):
        name = column[1] or column[2]
        named = [metadata.tables[word] for word in statement.words() if word in metadata.tables]
        column_names = sorted({column.name for table in named for column in table.columns})
        near = get_close_matches(name, column_names, 5, 0.5)
        what = f"did you mean {', '.join(near)}?" if near else f"columns: {', '.join(column_names)}"
        return QueryError(
            f"no column {name!r} in {', '.join(table.name for table in named) or 'the statement'}; "
            f"{what}"
        )
    if "one statement" in text or "multiple commands" in text:
        return QueryError("query takes one statement; the text has several, separated by ;")
    return QueryError(f"the statement cannot be run: {text}")


def list_tables() -> list[dict[str, Any]]:
    """Every table with the number of its columns and what a row of it is."""
    models = {str(mapper.local_table.name): mapper.class_ for mapper in Base.registry.mappers}  # type: ignore[attr-defined]
    return [
        {
            "table": name,
            "columns": len(table.columns),
            "a row is": _first_sentence(models.get(name)),
        }
        for name, table in sorted(metadata.tables.items())
    ]


def list_columns(name: str) -> list[dict[str, Any]]:
    """Columns of a table: type, unit, whether they may be empty, what they refer to. Raises
    `LookupError`."""
    if name not in metadata.tables:
        near = get_close_matches(name, metadata.tables, 3)
        hint = (
            f"did you mean {', '.join(near)}?"
            if near
            else f"tables: {', '.join(sorted(metadata.tables))}"
        )
        raise LookupError(f"no table {name!r} in the store; {hint}")
    return [
        {
            "column": column.name,
            "type": str(column.type),
            "unit": unit_of(column.name),
            "empty": "yes" if column.nullable else "no",
            "refers to": ", ".join(key.target_fullname for key in column.foreign_keys) or None,
        }
        for column in metadata.tables[name].columns
    ]


def unit_of(column: str) -> str | None:
    """The unit at the end of a column's name: `peak_force_n` is in N."""
    entry = unit_ending(column)
    return None if entry is None else entry.unit


def _first_sentence(model: type | None) -> str:
    text = " ".join(((model and model.__doc__) or "").split())
    return text.partition(". ")[0].rstrip(".")
