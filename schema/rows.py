"""Rows of any table as they are stored, a batch at a time, so that memory does not grow with the
table: read, hashed to what is the same on every engine, and written into an empty table, by COPY
where the engine has it."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, TypeVar

from sqlalchemy import (
    BigInteger,
    Column,
    ColumnElement,
    Connection,
    SmallInteger,
    Table,
    cast,
    column,
    func,
    insert,
    select,
    table,
)
from sqlalchemy.dialects.postgresql import REGCLASS
from sqlalchemy.exc import DBAPIError

from .column_kinds import (
    BYTES,
    DAY,
    INTEGER,
    JSON_TEXT,
    NUMBER,
    TEXT,
    TIME,
    TRUTH,
    kind_of,
    stored_type,
)
from .engine import StoreError, first_line
from .row_keys import sequence_of
from .tables import metadata

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
        cast(column, stored_type(column)).label(column.name)
        if kind_of(column) == JSON_TEXT
        else column
        for column in table.columns
    ]


class TableDigest:
    """SHA-256 over rows in the order of their keys, and their count.

    Numbers count by their bits but for the sign of zero, which SQLite does not keep; times by their
    instant; JSON by its text.
    """

    def __init__(self) -> None:
        self.rows = 0
        self._hash = hashlib.sha256()

    def watch(self, batches: Iterable[Sequence[Values]]) -> Iterator[Sequence[Values]]:
        """The batches as they are, counted and hashed on their way."""
        for batch in batches:
            for row in batch:
                # repr tells types, NaN, infinities and every bit of a number, and where a text
                # ends.
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
    """Insert all rows as they are, keys included. Raises `StoreError` with the table where the
    store refuses one."""
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
            target.name,
            *(
                column(target_column.name, stored_type(target_column))
                for target_column in target.columns
            ),
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
    return [
        table.autoincrement_column
        for table in metadata.sorted_tables
        if table.autoincrement_column is not None
    ]


def set_sequences(connection: Connection) -> None:
    """Let every counter go on after the largest key. SQLite has none."""
    if connection.dialect.name != "postgresql":
        return
    for key in counted_columns():
        last = connection.scalar(select(func.max(key)))
        if last is not None:
            connection.execute(select(func.setval(sequence_of(key), last)))


def iter_lagging(connection: Connection) -> Iterator[tuple[Column[int], int, int | None]]:
    """Keys whose counter will give a number that is taken: (column, largest key, what the counter
    gave last)."""
    if connection.dialect.name != "postgresql":
        return
    for key in counted_columns():
        last = connection.scalar(select(func.max(key)))
        counter = connection.scalar(
            select(func.pg_sequence_last_value(cast(sequence_of(key), REGCLASS)))
        )
        if last is not None and (counter is None or counter < last):
            yield key, last, counter
