"""Keys of new rows, known before the rows are written: their hash is made of them, too."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any
from weakref import WeakKeyDictionary

from sqlalchemy import Column, Connection, Select, Table, cast, func, literal, select, union_all
from sqlalchemy.dialects.postgresql import REGCLASS

#: Of a connection: the transaction that has reserved keys ahead, and those that are left, by table.
_STOCK = "pyroshock_reserved_keys"


def reserve_keys(connection: Connection, table: Table, count: int) -> list[int]:
    """Keys for so many new rows: of the counter, or in SQLite, whose writer is alone, those after
    the largest."""
    transaction, stock = connection.info.get(_STOCK, (None, {}))
    keys: list[int] = stock.get(table, []) if transaction is connection.get_transaction() else []
    if len(keys) < count:
        keys.clear()  # in SQLite others may be given for them
        return _new_keys(connection, {table: count})[table]
    reserved, keys[:count] = keys[:count], []
    return reserved


def reserve_ahead(connection: Connection, counts: Mapping[Table, int]) -> None:
    """Reserve keys of several tables in one statement: in the open transaction, `reserve_keys`
    gives them."""
    wanted = {table: count for table, count in counts.items() if count}
    connection.info[_STOCK] = (connection.get_transaction(), _new_keys(connection, wanted))


def _new_keys(connection: Connection, counts: Mapping[Table, int]) -> dict[Table, list[int]]:
    """So many keys of each table, in order."""
    if connection.dialect.name == "postgresql":
        numbers = [
            select(
                literal(table.name).label("name"),
                func.nextval(cast(sequence_of(_key(table)), REGCLASS)).label("key"),
            ).select_from(func.generate_series(1, count).table_valued("number"))
            for table, count in counts.items()
        ]
        rows = connection.execute(union_all(*numbers)).all()
        return {table: sorted(key for name, key in rows if name == table.name) for table in counts}
    largest = connection.execute(_largest_keys(tuple(counts))).one()
    return {
        table: list(range((last or 0) + 1, (last or 0) + 1 + count))
        for (table, count), last in zip(counts.items(), largest, strict=True)
    }


@cache
def _largest_keys(tables: tuple[Table, ...]) -> Select[Any]:
    return select(*(select(func.max(_key(table))).scalar_subquery() for table in tables))


def _next_value(table: Table) -> Any:
    return func.nextval(cast(sequence_of(_key(table)), REGCLASS))


def _key(table: Table) -> Column[int]:
    key = table.autoincrement_column
    assert key is not None, table.name
    return key


def sequence_of(key: Column[Any]) -> Any:
    """The counter of a key in PostgreSQL."""
    return func.pg_get_serial_sequence(literal(key.table.name), literal(key.name))


#: Keys that are reserved for the rows of a statement that is being executed.
_RESERVED: WeakKeyDictionary[Any, list[int]] = WeakKeyDictionary()


def key_on_insert(context: Any) -> int:
    """The default of a surrogate key: SQLAlchemy calls it once for each row of the statement in
    `context`."""
    keys = _RESERVED.get(context)
    if not keys:
        count = len(context.compiled_parameters)
        keys = _RESERVED[context] = reserve_keys(
            context.root_connection, context.compiled.statement.table, count
        )[::-1]
    return keys.pop()
