"""Hashes of rows that are there: read back and written where `row_hashes` marked them, and compared
by the check."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any, NamedTuple

from sqlalchemy import (
    ColumnElement,
    Connection,
    Table,
    Text,
    and_,
    bindparam,
    cast,
    func,
    select,
    text,
    tuple_,
    type_coerce,
    update,
)
from sqlalchemy.types import NULLTYPE

from .column_kinds import BYTES, JSON_TEXT, kind_of
from .row_hashes import ROW_SHA256, UNSEALED, row_hash, take_marked

#: Rows that are held at a time; of a table with frames, which take up to a megabyte each, fewer.
_BATCH, _BATCH_OF_FRAMES = 500, 20

#: In words that engines recognise as those of the partial index.
MARKED = f"{ROW_SHA256} = '{UNSEALED}'"


class HashedRow(NamedTuple):
    """A row's values as they are stored, by column; the hash that is stored with it, and that of
    its content now."""

    values: dict[str, Any]
    recorded: str | None
    computed: str


def iter_hashed(
    connection: Connection, table: Table, where: ColumnElement[bool] | None = None
) -> Iterator[Sequence[HashedRow]]:
    """The rows in batches, none empty, in the order in which the engine reads them."""
    query = select(*(_stored(connection, column) for column in table.columns))
    if where is not None:
        query = query.where(where)
    names = table.columns.keys()
    options = {"yield_per": _batch_size(table)}
    with (
        _undecodable_text(connection),
        connection.execute(query, execution_options=options) as result,
    ):
        for rows in result.partitions():
            yield [_hashed(table, dict(zip(names, row, strict=True))) for row in rows]


def _batch_size(table: Table) -> int:
    return _BATCH_OF_FRAMES if any(kind_of(column) == BYTES for column in table.columns) else _BATCH


def _hashed(table: Table, values: dict[str, Any]) -> HashedRow:
    recorded = values.pop(ROW_SHA256, None)
    return HashedRow(values, recorded, row_hash(table, values))


def _stored(connection: Connection, column: Any) -> ColumnElement[Any]:
    """Without any conversion of ours, which damaged values may not survive. A server hashes its
    bytes itself."""
    kind, raw = kind_of(column), type_coerce(column, NULLTYPE)
    if connection.dialect.name == "postgresql":
        if kind == JSON_TEXT:
            return cast(column, Text).label(column.name)
        if kind == BYTES:
            return func.encode(func.sha256(column), "hex").label(column.name)
    return raw.label(column.name)


@contextmanager
def _undecodable_text(connection: Connection) -> Iterator[None]:
    """Text of an SQLite file that is damaged is read all the same."""
    if connection.dialect.name != "sqlite":
        yield
        return
    driver: Any = connection.connection.dbapi_connection
    before = driver.text_factory
    driver.text_factory = lambda stored: stored.decode("utf-8", "surrogateescape")
    try:
        yield
    finally:
        driver.text_factory = before


def seal(connection: Connection) -> None:
    """Write the hashes of all rows that were marked on this connection: the last act before
    COMMIT."""
    for table in take_marked(connection):
        seal_table(connection, table, text(MARKED))  # type: ignore[arg-type]


def seal_table(
    connection: Connection, table: Table, where: ColumnElement[bool] | None = None
) -> None:
    """Write the hash of these rows of a table, or of all, as they are now."""
    keys = list(table.primary_key.columns)
    query = select(*keys)
    rows_of_keys = connection.execute(query if where is None else query.where(where)).all()
    row_is = and_(*(key == bindparam(f"key_{key.name}") for key in keys))
    statement = update(table).where(row_is).values({ROW_SHA256: bindparam("hash")})
    size = _batch_size(table)
    for first in range(0, len(rows_of_keys), size):
        chosen = tuple_(*keys).in_([tuple(row) for row in rows_of_keys[first : first + size]])
        hashes = [
            {"hash": row.computed} | {f"key_{key.name}": row.values[key.name] for key in keys}
            for batch in iter_hashed(connection, table, chosen)
            for row in batch
        ]
        connection.execute(statement, hashes)
