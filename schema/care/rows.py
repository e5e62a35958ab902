"""Rows of any table as they are stored, a batch at a time: memory does not grow with the table."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from sqlalchemy import ColumnElement, Connection, Table, cast, select

from .kinds import BYTES, JSON_TEXT, kind_of, stored_type

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
