"""Rows of any table as they are stored, a batch at a time: memory does not grow with the table.

What a column holds, whatever the engine calls it.

A table's content as one hash that is the same on every engine.

How far work over many rows is.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, TypeVar

from sqlalchemy import (
    JSON,
    Boolean,
    Column,
    ColumnElement,
    Connection,
    Date,
    DateTime,
    Float,
    Integer,
    LargeBinary,
    String,
    Table,
    Text,
    cast,
    select,
)
from sqlalchemy.types import TypeDecorator

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
