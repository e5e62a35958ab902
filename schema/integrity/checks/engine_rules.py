"""What the engine rules, or should: the tables are those that this software reads and writes, each
value is of its column's kind (SQLite takes any), every foreign key leads to a row, pages and
indices are sound, and PostgreSQL gives the next row a key that is free."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from sqlalchemy import (
    Column,
    ColumnElement,
    Connection,
    ForeignKey,
    FromClause,
    Integer,
    Table,
    TextClause,
    and_,
    cast,
    func,
    inspect,
    or_,
    select,
    text,
)

from ...column_kinds import BYTES, DAY, INTEGER, JSON_TEXT, NUMBER, TEXT, TIME, TRUTH, kind_of
from ...rows import iter_lagging
from ...tables import metadata
from ..findings import RESTORE, IntegrityFinding, Scope


def tables_there(connection: Connection) -> list[Table]:
    """The tables of ours that the store has: one that is missing keeps no other from being looked
    at."""
    names = set(inspect(connection).get_table_names())
    return [table for table in metadata.sorted_tables if table.name in names]


def check_tables(connection: Connection, _: Scope) -> Iterator[IntegrityFinding]:
    """Tables, columns and indices that are missing: somebody has taken them away by hand."""
    there = inspect(connection)
    names = set(there.get_table_names())
    for table in metadata.sorted_tables:
        if table.name not in names:
            yield IntegrityFinding("tables", "the table is missing", RESTORE, {"table": table.name})
            continue
        columns = {column["name"] for column in there.get_columns(table.name)}
        indices = {index["name"] for index in there.get_indexes(table.name)}
        missing = [
            f"column {column.name}" for column in table.columns if column.name not in columns
        ]
        missing += [f"index {index.name}" for index in table.indexes if index.name not in indices]
        for what in sorted(missing):
            yield IntegrityFinding("tables", f"{what} is missing", RESTORE, {"table": table.name})


_STORED_AS = {
    INTEGER: ("integer",),
    NUMBER: ("real", "integer"),
    TEXT: ("text",),
    JSON_TEXT: ("text", "integer", "real"),  # of a JSON number the file keeps the number
    TRUTH: ("integer",),
    TIME: ("text",),
    DAY: ("text",),
    BYTES: ("blob",),
}
#: As SQLAlchemy writes them, and reads them back.
_FORMS = {TIME: "____-__-__ __:__:__.______", DAY: "____-__-__"}


def check_values(connection: Connection, _: Scope) -> Iterator[IntegrityFinding]:
    """Columns of an SQLite file that hold something of another kind."""
    if connection.dialect.name != "sqlite":
        return
    for table in tables_there(connection):
        columns = list(table.columns)
        counts = connection.execute(
            select(*(func.count().filter(_wrong(column)) for column in columns)).select_from(table)
        ).one()
        for column, count in zip(columns, counts, strict=True):
            if count:
                message = f"{count} rows hold no {kind_of(column)} in {column.name}"
                yield IntegrityFinding("values", message, RESTORE, {"table": table.name})


def _wrong(column: Column[Any]) -> ColumnElement[bool]:
    kind, raw = kind_of(column), func.typeof(column)
    allowed = (*_STORED_AS[kind], *(("null",) if column.nullable else ()))
    wrong: list[ColumnElement[bool]] = [raw.not_in(allowed)]
    if kind in (TEXT, JSON_TEXT):
        wrong.append(func.instr(column, func.char(0)) > 0)
    if kind == JSON_TEXT:
        wrong.append(and_(column.is_not(None), func.json_valid(column) == 0))
    if kind in _FORMS:
        wrong.append(
            and_(
                raw == "text",
                or_(func.like(_FORMS[kind], column) == 0, func.julianday(column).is_(None)),
            )
        )
    if kind == TRUTH:
        wrong.append(and_(raw == "integer", cast(column, Integer).not_in((0, 1))))
    return or_(*wrong)


#: Rows of one key that are named; the others are counted.
_MOST = 5


def check_references(connection: Connection, _: Scope) -> Iterator[IntegrityFinding]:
    """Rows that point at a row which is not there."""
    there = tables_there(connection)
    for table in there:
        keys = sorted(
            (key for key in table.foreign_keys if key.column.table in there),
            key=lambda key: key.parent.name,
        )
        if not keys:
            continue
        joined, orphans = _joined(table, keys)
        counts = connection.execute(
            select(*(func.count().filter(orphan) for orphan in orphans)).select_from(joined)
        ).one()
        for key, orphan, count in zip(keys, orphans, counts, strict=True):
            if count:
                yield from _named(connection, joined, key, orphan, count)


def _joined(table: Table, keys: list[ForeignKey]) -> tuple[FromClause, list[ColumnElement[bool]]]:
    """The table beside all that it points at, and for each key when it leads nowhere."""
    joined: FromClause = table
    orphans: list[ColumnElement[bool]] = []
    for number, key in enumerate(keys):
        target = key.column.table.alias(f"target_{number}")
        there: ColumnElement[Any] = target.c[key.column.name]
        joined = joined.outerjoin(target, key.parent == there)
        orphans.append(and_(key.parent.is_not(None), there.is_(None)))
    return joined, orphans


def _named(
    connection: Connection,
    joined: FromClause,
    key: ForeignKey,
    orphan: ColumnElement[bool],
    count: int,
) -> Iterator[IntegrityFinding]:
    column, table, target = key.parent, key.parent.table.name, key.column.table.name
    query = (
        select(*key.parent.table.primary_key.columns, column)
        .select_from(joined)
        .where(orphan)
        .limit(_MOST)
    )
    for *row, value in connection.execute(query):
        place = {"table": table, "row": "/".join(map(str, row))}
        yield IntegrityFinding(
            "references", f"{column.name} is {value}, and {target} has no such row", RESTORE, place
        )
    if count > _MOST:
        message = f"{count - _MOST} further rows whose {column.name} leads nowhere"
        yield IntegrityFinding("references", message, RESTORE, {"table": table})


_WHOLE, _PAGES = text("PRAGMA integrity_check(20)"), text("PRAGMA quick_check(20)")


def check_database(connection: Connection, _: Scope) -> Iterator[IntegrityFinding]:
    """Every page and index of an SQLite file. PostgreSQL checks its pages by its own means."""
    yield from _findings_of_query(connection, _WHOLE)


def check_pages(connection: Connection, _: Scope) -> Iterator[IntegrityFinding]:
    """`check_database` without comparing indices to their tables: a third of the time."""
    yield from _findings_of_query(connection, _PAGES)


def _findings_of_query(connection: Connection, question: TextClause) -> Iterator[IntegrityFinding]:
    if connection.dialect.name != "sqlite":
        return
    for line in connection.scalars(question):
        if line != "ok":
            yield IntegrityFinding("database", str(line), RESTORE)


def check_sequences(connection: Connection, _: Scope) -> Iterator[IntegrityFinding]:
    """Counters behind the largest key: the next insert would be refused."""
    for key, last, given in iter_lagging(connection):
        table = key.table.name
        advice = f"run: SELECT setval(pg_get_serial_sequence('{table}', '{key.name}'), {last})"
        yield IntegrityFinding(
            "sequences",
            f"the counter stands at {given or 0}, the largest key is {last}",
            advice,
            {"table": table},
        )
