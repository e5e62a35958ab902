"""Keys of new rows, known before the rows are written: their hash is made of them, too."""

from __future__ import annotations

from typing import Any
from weakref import WeakKeyDictionary

from sqlalchemy import Column, Connection, Table, cast, func, literal, select
from sqlalchemy.dialects.postgresql import REGCLASS


def reserve_keys(connection: Connection, table: Table, count: int) -> list[int]:
    """Keys for so many new rows: of the counter, or in SQLite, whose writer is alone, those after the largest."""
    key = table.autoincrement_column
    assert key is not None, table.name
    if connection.dialect.name == "postgresql":
        next_value = func.nextval(cast(sequence_of(key), REGCLASS))
        numbers = func.generate_series(1, count).table_valued("number")
        return sorted(connection.scalars(select(next_value).select_from(numbers)))
    first = (connection.scalar(select(func.max(key))) or 0) + 1
    return list(range(first, first + count))


def sequence_of(key: Column[Any]) -> Any:
    """The counter of a key in PostgreSQL."""
    return func.pg_get_serial_sequence(literal(key.table.name), literal(key.name))


#: Keys that are reserved for the rows of a statement that is being executed.
_RESERVED: WeakKeyDictionary[Any, list[int]] = WeakKeyDictionary()


def key_on_insert(context: Any) -> int:
    """The default of a surrogate key: SQLAlchemy calls it once for each row of the statement in `context`."""
    keys = _RESERVED.get(context)
    if not keys:
        count = len(context.compiled_parameters)
        keys = _RESERVED[context] = reserve_keys(context.root_connection, context.compiled.statement.table, count)[::-1]
    return keys.pop()
