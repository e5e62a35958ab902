"""Rows into an empty table, a batch at a time: by COPY where the engine has it.

Where PostgreSQL counts on from: a row that came with its key does not move the counter.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any

from sqlalchemy import (
    BigInteger,
    Column,
    Connection,
    SmallInteger,
    Table,
    cast,
    column,
    func,
    insert,
    literal,
    select,
    table,
)
from sqlalchemy.dialects.postgresql import REGCLASS
from sqlalchemy.exc import DBAPIError

from .engine import StoreError, first_line
from .rows import BYTES, DAY, INTEGER, JSON_TEXT, NUMBER, TEXT, TIME, TRUTH, Values, kind_of, stored_type
from .tables import metadata

#: In the binary form of COPY a JSON value is its text.
_POSTGRES = {
    INTEGER: "int4",
    NUMBER: "float8",
    TEXT: "text",
    JSON_TEXT: "text",
    TRUTH: "bool",
    TIME: "timestamptz",
    DAY: "date",
    BYTES: "bytea",
}


def load(connection: Connection, target: Table, batches: Iterable[Sequence[Values]]) -> None:
    """Insert all rows as they are, keys included. Raises `StoreError` with the table where the store refuses one."""
    put: Callable[[Connection, Table, Iterable[Sequence[Values]]], None]
    put = _by_copy if connection.dialect.name == "postgresql" else _by_insert
    try:
        put(connection, target, batches)
    except DBAPIError as error:
        raise StoreError(f"table {target.name} is refused: {first_line(error)}") from error


def insert_into(target: Table) -> Any:
    """An insert that takes a row's values as they are stored."""
    return insert(
        table(
            target.name, *(column(target_column.name, stored_type(target_column)) for target_column in target.columns)
        )
    )


def _by_insert(connection: Connection, target: Table, batches: Iterable[Sequence[Values]]) -> None:
    names, statement = target.columns.keys(), insert_into(target)
    for batch in batches:
        connection.execute(statement, [dict(zip(names, row, strict=True)) for row in batch])


def _by_copy(connection: Connection, target: Table, batches: Iterable[Sequence[Values]]) -> None:
    """Five times as fast as inserts, and bytes go as they are instead of as hexadecimal text."""
    from psycopg import Error, sql

    driver: Any = connection.connection
    statement = sql.SQL("COPY {} ({}) FROM STDIN (FORMAT BINARY)").format(
        sql.Identifier(target.name), sql.SQL(", ").join(map(sql.Identifier, target.columns.keys()))
    )
    try:
        with driver.cursor() as cursor, cursor.copy(statement) as copy:
            copy.set_types([_postgres_type(column) for column in target.columns])
            for batch in batches:
                for row in batch:
                    copy.write_row(row)
    except (Error, OverflowError) as error:
        raise StoreError(f"table {target.name} is refused: {str(error).splitlines()[0]}") from error


def _postgres_type(of: Column[Any]) -> str:
    if isinstance(of.type, BigInteger):
        return "int8"
    return "int2" if isinstance(of.type, SmallInteger) else _POSTGRES[kind_of(of)]


def counted_columns() -> list[Column[int]]:
    """The keys that an engine gives."""
    return [table.autoincrement_column for table in metadata.sorted_tables if table.autoincrement_column is not None]


def set_sequences(connection: Connection) -> None:
    """Let every counter go on after the largest key. SQLite has none."""
    if connection.dialect.name != "postgresql":
        return
    for key in counted_columns():
        last = connection.scalar(select(func.max(key)))
        if last is not None:
            connection.execute(select(func.setval(_sequence(key), last)))


def reserve_keys(connection: Connection, table: Table, count: int) -> list[int]:
    """Keys for so many new rows: of the counter, or in SQLite, whose writer is alone, those after the largest."""
    key = table.autoincrement_column
    assert key is not None, table.name
    if connection.dialect.name == "postgresql":
        next_value = func.nextval(cast(_sequence(key), REGCLASS))
        numbers = func.generate_series(1, count).table_valued("number")
        return sorted(connection.scalars(select(next_value).select_from(numbers)))
    first = (connection.scalar(select(func.max(key))) or 0) + 1
    return list(range(first, first + count))


def iter_lagging(connection: Connection) -> Iterator[tuple[Column[int], int, int | None]]:
    """Keys whose counter will give a number that is taken: (column, largest key, what the counter gave last)."""
    if connection.dialect.name != "postgresql":
        return
    for key in counted_columns():
        last = connection.scalar(select(func.max(key)))
        given = connection.scalar(select(func.pg_sequence_last_value(cast(_sequence(key), REGCLASS))))
        if last is not None and (given is None or given < last):
            yield key, last, given


def _sequence(key: Column[int]) -> object:
    return func.pg_get_serial_sequence(literal(key.table.name), literal(key.name))
