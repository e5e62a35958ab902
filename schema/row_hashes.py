"""Every row carries the SHA-256 of itself (`row_sha256`, declared once in `base.Base`), so that a
number or a sentence that was altered in the store is noticed, whichever its table and column.

What is hashed is the row's canonical form: one line for each column that is not NULL, by name, the
row's own keys and references included and `row_sha256` excepted. Numbers count by all of their
bits, times by their instant in UTC, JSON by its stored text, bytes by their SHA-256. Both engines
give the same form; what one of them does not keep (the sign of zero; NaN, which SQLite takes for
NULL) does not count. A column that a later revision adds changes no hash while it is NULL; a
revision that gives it a value calls `row_sealing.seal_table`.

How a hash is made on write:

- INSERT through a model, by the ORM or not: the row's key is reserved first (`row_keys`), and
  `row_sha256` is a default that is computed of the row's own parameters. The row arrives whole and
  needs no UPDATE, so that tables may be append-only. A role that inserts needs USAGE on the table's
  sequence.
- UPDATE through a model, of whatever rows: `row_sha256` becomes `UNSEALED` with it. Before COMMIT,
  `Store.writing` calls `row_sealing.seal`, which reads these rows by their partial index and writes
  their hashes: an UPDATE of `row_sha256` alone, on rows that the transaction has changed anyway. A
  role that may update any column of a table must be able to update `row_sha256` there.
- Rows that come from another store (`transfer.merging`) get theirs by `row_hash` after their keys
  are those of here.

SQL that bypasses all of this leaves `row_sha256` as it is, or NULL: the check names the row.
Nothing that is read back is sealed unless this software has marked it, so that a row which was
inserted by hand is not approved by the next command. A writer that dies leaves nothing, for what it
marked and did not seal was never committed.
"""

from __future__ import annotations

import datetime as dt
import hashlib
import json
import math
from collections.abc import Mapping
from functools import cache
from typing import Any, NamedTuple

from sqlalchemy import Connection, Table
from sqlalchemy.types import TypeDecorator

from .column_kinds import BYTES, INTEGER, JSON_TEXT, NUMBER, TEXT, kind_of

ROW_SHA256 = "row_sha256"
#: In place of the hash: the row was changed in a transaction that has not ended yet.
UNSEALED = "unsealed"
#: In place of the hash: the row's figures had another SHA-256 than the recorded one when the store
#: was upgraded.
ALTERED = "altered before revision 0011"

_MARKED = "pyroshock_unsealed_tables"


def row_hash(table: Table, row: Mapping[str, Any]) -> str:
    """SHA-256 of a row with its values as they are stored; a column that `row` lacks is NULL."""
    form = [
        b"%s=%s" % (name.encode(), _canonical(kind, value))
        for name, kind in hashed_columns(table)
        if (value := row.get(name)) is not None
    ]
    return hashlib.sha256(b"\n".join(form)).hexdigest()


@cache
def hashed_columns(table: Table) -> tuple[tuple[str, str], ...]:
    """Name and kind of each column that counts, by name."""
    kinds = {column.name: kind_of(column) for column in table.columns if column.name != ROW_SHA256}
    return tuple(sorted(kinds.items()))


def _canonical(kind: str, value: Any) -> bytes:
    """A stored value that is not None as bytes: its type, its length where it has one, and all of
    it.

    A value of another kind than its column's, which SQLite takes, has a form too.
    """
    if type(value) is float:  # most are
        return b"number " + (value + 0.0).hex().encode()
    if isinstance(value, dt.datetime):
        value = value if value.tzinfo is None else value.astimezone(dt.UTC).replace(tzinfo=None)
        value = value.isoformat(" ", "microseconds")
    elif isinstance(value, dt.date):
        value = value.isoformat()
    if isinstance(value, str) and kind == JSON_TEXT and value[:1] in _NUMBER_BEGINS:
        value = _number(value)
    if isinstance(value, str):
        text = value.encode("utf-8", "surrogateescape")
        # Of bytes, a server gives its own SHA-256 of them.
        return b"bytes " + text if kind == BYTES else b"text %d %s" % (len(text), text)
    if isinstance(value, (bytes, bytearray, memoryview)):
        return b"bytes " + hashlib.sha256(value).hexdigest().encode()
    if isinstance(value, int) and kind not in (NUMBER, JSON_TEXT):
        return b"integer %d" % value
    return b"number " + (float(value) + 0.0).hex().encode()


#: A JSON value that is one number is kept by SQLite as a number, and its text is not.
_NUMBER_BEGINS = tuple("-0123456789")


def _number(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text


def hash_on_insert(context: Any) -> str:
    """The default of `row_sha256`: SQLAlchemy gives it the statement with the row that is written.

    `UNSEALED` where the statement does not say what will be stored: what an expression gives, what
    is converted.
    """
    statement, connection = context.compiled.statement, context.root_connection
    if statement.select is None and not statement._multi_values and not context.compiled.postfetch:
        return hash_of_new(connection, statement.table, context.get_current_parameters())
    return mark(connection, statement.table)


def hash_of_new(connection: Connection, table: Table, values: Mapping[str, Any]) -> str:
    """`row_hash` of a row that is inserted on this connection with such values for its columns, as
    the engine will keep them; `UNSEALED`, marked, where it would convert one."""
    form = []
    for column in _written_columns(table):
        value: Any = values.get(column.name)
        kind = type(value)
        # Most values are of their column's own kind, and take half of the time so.
        if kind is float and column.kind == NUMBER and value == value:
            content = b"number " + (value + 0.0).hex().encode()
        elif kind is int and column.kind == INTEGER:
            content = b"integer %d" % value
        elif column.name not in values:
            continue
        else:
            stored = _bound(column, value, connection.dialect)
            if stored is _CONVERTED:
                return mark(connection, table)
            if stored is None:
                continue
            content = _canonical(column.kind, stored)
        form.append(column.prefix + content)
    return hashlib.sha256(b"\n".join(form)).hexdigest()


def mark_on_update(context: Any) -> str:
    """What an UPDATE gives `row_sha256`."""
    return mark(context.root_connection, context.compiled.statement.table)


def mark(connection: Connection, table: Table) -> str:
    """`UNSEALED`, for a row of this table; `row_sealing.seal` looks there."""
    connection.info.setdefault(_MARKED, set()).add(table)
    return UNSEALED


def take_marked(connection: Connection) -> list[Table]:
    """Tables with rows that were marked on this connection since this was last called."""
    return sorted(connection.info.pop(_MARKED, ()), key=lambda table: table.name)


class _WrittenColumn(NamedTuple):
    """What a column does to the value that an INSERT gives it; `prefix` begins its line of the
    canonical form, and `null` is what None is stored as."""

    name: str
    prefix: bytes
    kind: str
    decorator: TypeDecorator[Any] | None
    null: str | None


@cache
def _written_columns(table: Table) -> tuple[_WrittenColumn, ...]:
    """Those that count, by name. Looked up once for a table: it takes longer than the hash of a
    row."""
    columns = []
    for column in table.columns:
        if column.name != ROW_SHA256:
            decorator = column.type if isinstance(column.type, TypeDecorator) else None
            own, kind = (
                column.type if decorator is None else decorator.impl_instance,
                kind_of(column),
            )
            is_null = kind != JSON_TEXT or getattr(own, "none_as_null", False)
            columns.append(
                _WrittenColumn(
                    column.name,
                    b"%s=" % column.name.encode(),
                    kind,
                    decorator,
                    None if is_null else "null",
                )
            )
    return tuple(sorted(columns, key=lambda column: column.name))


_CONVERTED = object()


def _bound(column: _WrittenColumn, value: Any, dialect: Any) -> Any:
    if column.decorator is not None:
        value = column.decorator.process_bind_param(value, dialect)
    if value is None:
        return column.null
    kind = column.kind
    if kind == JSON_TEXT:
        return json.dumps(value)
    if kind == NUMBER and isinstance(value, (float, int)):
        return None if math.isnan(value) and dialect.name == "sqlite" else float(value)
    expected = _PYTHON.get(kind)
    return value if expected is None or isinstance(value, expected) else _CONVERTED


_PYTHON: dict[str, Any] = {INTEGER: int, TEXT: str, NUMBER: float}
