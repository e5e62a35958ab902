"""Rows into tables by the thousand: PostgreSQL's COPY, and one statement a batch elsewhere."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from itertools import chain, islice
from typing import Any

from pyroshock.schema.base import Base
from pyroshock.schema.session import Store
from pyroshock.schema.tables import metadata
from sqlalchemy import Connection, func, insert, select

_BATCH = 20_000

Row = dict[str, Any]


def insert_rows(connection: Connection, model: type[Base], rows: Iterable[Row], signed: int) -> None:
    """`rows`, all with the same keys, as written by the command of provenance row `signed`."""
    waiting: Iterator[Row] = ({**row, "written_by_id": signed} for row in rows)
    if connection.dialect.name == "postgresql":
        _copy(connection, model, waiting)
        return
    while batch := list(islice(waiting, _BATCH)):
        connection.execute(insert(model), batch)


def _copy(connection: Connection, model: type[Base], rows: Iterator[Row]) -> None:
    from psycopg import sql

    first = next(rows, None)
    if first is None:
        return
    command = sql.SQL("COPY {} ({}) FROM STDIN").format(
        sql.Identifier(model.__tablename__), sql.SQL(", ").join(map(sql.Identifier, first))
    )
    makers = [_maker(connection, model, name) for name in first]
    driver: Any = connection.connection
    with driver.cursor() as cursor, cursor.copy(command) as copy:
        for row in chain([first], rows):
            copy.write_row([make(value) for make, value in zip(makers, row.values(), strict=True)])


def _maker(connection: Connection, model: type[Base], column: str) -> Callable[[Any], Any]:
    """What the column's type makes of a value on its way to the driver."""
    of_type = model.__table__.c[column].type.dialect_impl(connection.dialect)
    if of_type.python_type is bytes:  # the driver's own wrapper is for parameters, not for COPY
        return bytes
    return of_type.bind_processor(connection.dialect) or (lambda value: value)


def tidy(store: Store) -> None:
    """What PostgreSQL's own service does within a minute of a large insert, and SQLite never does; and keys go on
    after those that were given."""
    if store.engine.dialect.name != "postgresql":
        return
    with store.engine.connect().execution_options(isolation_level="AUTOCOMMIT") as connection:
        for table in metadata.sorted_tables:
            if "id" in table.c:
                sequence = func.pg_get_serial_sequence(table.name, "id")
                connection.execute(select(func.setval(sequence, func.coalesce(func.max(table.c.id), 0) + 1, False)))
        connection.exec_driver_sql("VACUUM ANALYZE")
