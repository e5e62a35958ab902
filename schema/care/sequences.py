"""Where PostgreSQL counts on from: a row that came with its key does not move the counter."""

from __future__ import annotations

from collections.abc import Iterator

from sqlalchemy import Column, Connection, Table, cast, func, literal, select
from sqlalchemy.dialects.postgresql import REGCLASS

from ..tables import metadata


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
