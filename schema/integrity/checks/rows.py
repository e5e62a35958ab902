"""Every row of every table is the one that was written: by the SHA-256 that it carries."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from sqlalchemy import Connection, ForeignKey, Table, select
from sqlalchemy.exc import DBAPIError

from ...base import NAMES_ROW
from ...campaign_rows import members
from ...column_kinds import BYTES, kind_of
from ...engine import first_line
from ...row_hashes import ALTERED, UNSEALED
from ...row_sealing import HashedRow, iter_hashed
from ..findings import COUNT_ANEW, RESTORE, IntegrityFinding, Scope
from .engine_rules import tables_there
from .series import ADVICE as REREAD

#: Rows of one table that are named; the others are counted.
_MOST = 100
_WRITERS = "provenance"
_ADVICE = {"series_chunks": REREAD, "campaign_counts": COUNT_ANEW}


def check_rows(connection: Connection, scope: Scope) -> Iterator[IntegrityFinding]:
    """Rows that are not those that were written, by table and key, and by what people know them
    by."""
    for table in tables_there(connection):
        yield from _altered_rows(connection, scope, table)


def check_rows_without_bytes(connection: Connection, scope: Scope) -> Iterator[IntegrityFinding]:
    """`check_rows` of all tables but those of series and pulses, whose every byte would be read."""
    for table in tables_there(connection):
        if not any(kind_of(column) == BYTES for column in table.columns):
            yield from _altered_rows(connection, scope, table)


def _altered_rows(connection: Connection, scope: Scope, table: Table) -> Iterator[IntegrityFinding]:
    chosen = None if scope.campaign is None else members(scope.campaign).get(table.name)
    if scope.campaign is not None and chosen is None:
        return
    altered = []
    try:
        for batch in iter_hashed(connection, table, chosen):
            altered += [row for row in batch if row.recorded != row.computed]
    except DBAPIError as error:
        if connection.dialect.name == "postgresql":
            raise  # nothing is answered after an error there
        yield IntegrityFinding(
            "rows", f"cannot be read: {first_line(error)}", RESTORE, {"table": table.name}
        )
    for row in altered[:_MOST]:
        key = "/".join(str(row.values[column.name]) for column in table.primary_key.columns)
        place = {**_names(connection, table, row.values), "table": table.name, "row": key}
        yield IntegrityFinding("rows", _problem(row), _ADVICE.get(table.name, RESTORE), place)
    if len(altered) > _MOST:
        message = f"{len(altered) - _MOST} further rows were altered"
        yield IntegrityFinding("rows", message, RESTORE, {"table": table.name})


def _problem(row: HashedRow) -> str:
    if row.recorded is None:
        return "the row carries no hash: it was not written by this software"
    if row.recorded == UNSEALED:
        return "the row was changed outside of a transaction of the store, and never given its hash"
    if row.recorded == ALTERED:
        return "a figure was altered before the store was upgraded to revision 0011"
    return (
        f"the row was altered: its values have the SHA-256 {row.computed[:12]}…, it was written "
        f"with {row.recorded[:12]!s}…"
    )


def _names(connection: Connection, table: Table, values: Mapping[str, Any]) -> dict[str, Any]:
    """By what people know a row: the names of the rows that it belongs to, then its own."""
    levels: list[dict[str, Any]] = []
    waiting: list[tuple[Table, Mapping[str, Any]]] = [(table, values)]
    while waiting:
        table, values = waiting.pop(0)
        own = {
            column.info[NAMES_ROW]: values[column.name]
            for column in table.columns
            if NAMES_ROW in column.info
        }
        levels.append({label: name for label, name in own.items() if name is not None})
        if any(column.unique and NAMES_ROW in column.info for column in table.columns):
            continue  # its own name tells it apart
        keys = sorted(table.foreign_keys, key=lambda key: key.parent.name)
        waiting += [
            parent for key in keys if (parent := _parent(connection, key, values)) is not None
        ]
    names: dict[str, Any] = {}
    for level in reversed(levels):
        names |= level  # of two runs, the nearer
    return names


def _parent(
    connection: Connection, key: ForeignKey, values: Mapping[str, Any]
) -> tuple[Table, Mapping[str, Any]] | None:
    """The row that a reference leads to, with its names and references; None where there is
    none."""
    parent, value = key.column.table, values[key.parent.name]
    if parent.name == _WRITERS or not isinstance(value, int):
        return None
    wanted = [
        column for column in parent.columns if NAMES_ROW in column.info or column.foreign_keys
    ]
    if not wanted:
        return None
    row = connection.execute(select(*wanted).where(key.column == value)).mappings().one_or_none()
    return None if row is None else (parent, dict(row))
