"""Rows of any table as they are stored, a batch at a time, so that memory does not grow with the table: read, hashed to
what is the same on every engine, and written into an empty table, by COPY where the engine has it."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, TypeVar

from sqlalchemy import (
    JSON,
    BigInteger,
    Boolean,
    Column,
    ColumnElement,
    Connection,
    Date,
    DateTime,
    Float,
    Integer,
    LargeBinary,
    SmallInteger,
    String,
    Table,
    Text,
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
from sqlalchemy.types import TypeDecorator

from .engine import StoreError, first_line
from .tables import metadata

INTEGER, NUMBER, TEXT, JSON_TEXT, TRUTH, TIME, DAY, BYTES = (
    "integer",
    "number",
    "text",
    "json",
    "truth",
    "time",
    "day",
    "bytes",
)
_KINDS: tuple[tuple[type[Any], str], ...] = (
    (JSON, JSON_TEXT),
    (LargeBinary, BYTES),
    (Boolean, TRUTH),
    (Integer, INTEGER),
    (Float, NUMBER),
    (DateTime, TIME),
    (Date, DAY),
    (String, TEXT),
)


def kind_of(column: Column[Any]) -> str:
    """One of the kinds above. Raises `TypeError` for a type that no table had when this was written."""
    own = column.type.impl_instance if isinstance(column.type, TypeDecorator) else column.type
    for known_type, kind in _KINDS:
        if isinstance(own, known_type):
            return kind
    raise TypeError(f"{column} is a {own!r}: say in schema/rows.py how it is copied and checked")


def stored_type(column: Column[Any]) -> Any:
    """The type by which a value is read and written as it is stored: JSON is its text, so that nothing is rewritten."""
    return Text() if kind_of(column) == JSON_TEXT else column.type


#: A row's values in the order of the table's columns.
Values = Sequence[Any]

#: Rows at a time; of a table with frames, which take up to a megabyte each, fewer.
_BATCH, _BATCH_OF_FRAMES = 2000, 50


def iter_batches(
    connection: Connection, table: Table, where: ColumnElement[bool] | None = None
) -> Iterator[Sequence[Values]]:
    """The rows in the order of their keys, no batch empty."""
    query = select(*stored_columns(table)).order_by(*table.primary_key.columns)
    if where is not None:
        query = query.where(where)
    with connection.execute(query, execution_options={"yield_per": batch_size(table)}) as result:
        yield from result.partitions()


def batch_size(table: Table) -> int:
    """Rows of this table that are held at a time."""
    return _BATCH_OF_FRAMES if any(kind_of(column) == BYTES for column in table.columns) else _BATCH


def stored_columns(table: Table) -> list[ColumnElement[Any]]:
    """What to select for the values as they are stored."""
    return [
        cast(column, stored_type(column)).label(column.name) if kind_of(column) == JSON_TEXT else column
        for column in table.columns
    ]


class TableDigest:
    """SHA-256 over rows in the order of their keys, and their count.

    Numbers count by their bits but for the sign of zero, which SQLite does not keep; times by their instant; JSON by
    its text.
    """

    def __init__(self) -> None:
        self.rows = 0
        self._hash = hashlib.sha256()

    def watch(self, batches: Iterable[Sequence[Values]]) -> Iterator[Sequence[Values]]:
        """The batches as they are, counted and hashed on their way."""
        for batch in batches:
            for row in batch:
                # repr tells types, NaN, infinities and every bit of a number, and where a text ends.
                self._hash.update(repr([_plain(value) for value in row]).encode())
            self.rows += len(batch)
            yield batch

    def take(self, batches: Iterable[Sequence[Values]]) -> TableDigest:
        """`watch` to the end; returns itself."""
        for _ in self.watch(batches):
            pass
        return self

    def __eq__(self, other: object) -> bool:
        return isinstance(other, TableDigest) and (self.rows, self.hex) == (other.rows, other.hex)

    __hash__ = None  # type: ignore[assignment]  # it changes with every row

    @property
    def hex(self) -> str:
        return self._hash.hexdigest()


def _plain(value: Any) -> Any:
    if type(value) is float:
        return value + 0.0  # -0.0 becomes 0.0
    return hashlib.sha256(value).digest() if type(value) is bytes else value


Item = TypeVar("Item")

#: Called with (done, total, what).
Progress = Callable[[int, int, str], None]


class ProgressBar:
    """Counts to `total` and tells it on."""

    def __init__(self, progress: Progress | None, total: int) -> None:
        self._progress = progress
        self._total = total
        self._done = 0

    def step(self, count: int, what: str) -> None:
        self._done += count
        if self._progress is not None:
            self._progress(self._done, self._total, what)

    def watch(self, batches: Iterable[Sequence[Item]], what: str) -> Iterator[Sequence[Item]]:
        """The batches as they are, counted once they were used."""
        for batch in batches:
            yield batch
            self.step(len(batch), what)


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
