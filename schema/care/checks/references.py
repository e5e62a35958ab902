"""Every foreign key leads to a row: also where a program wrote an SQLite file with its keys switched off."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from sqlalchemy import ColumnElement, Connection, ForeignKey, FromClause, Table, and_, func, select

from ..findings import IntegrityFinding
from .scope import RESTORE, Scope
from .tables import tables_there

#: Rows of one key that are named; the others are counted.
_MOST = 5


def check_references(connection: Connection, _: Scope) -> Iterator[IntegrityFinding]:
    """Rows that point at a row which is not there."""
    there = tables_there(connection)
    for table in there:
        keys = sorted((key for key in table.foreign_keys if key.column.table in there), key=lambda key: key.parent.name)
        if not keys:
            continue
        joined, orphans = _joined(table, keys)
        counts = connection.execute(
            select(*(func.count().filter(orphan) for orphan in orphans)).select_from(joined)
        ).one()
        for key, orphan, count in zip(keys, orphans, counts, strict=True):
            if count:
                yield from _named(connection, joined, key, orphan, count)


def _joined(table: Table, keys: list[ForeignKey]) -> tuple[FromClause, list[ColumnElement[bool]]]:
    """The table beside all that it points at, and for each key when it leads nowhere."""
    joined: FromClause = table
    orphans: list[ColumnElement[bool]] = []
    for number, key in enumerate(keys):
        target = key.column.table.alias(f"target_{number}")
        there: ColumnElement[Any] = target.c[key.column.name]
        joined = joined.outerjoin(target, key.parent == there)
        orphans.append(and_(key.parent.is_not(None), there.is_(None)))
    return joined, orphans


def _named(
    connection: Connection, joined: FromClause, key: ForeignKey, orphan: ColumnElement[bool], count: int
) -> Iterator[IntegrityFinding]:
    column, table, target = key.parent, key.parent.table.name, key.column.table.name
    query = select(*key.parent.table.primary_key.columns, column).select_from(joined).where(orphan).limit(_MOST)
    for *row, value in connection.execute(query):
        place = {"table": table, "row": "/".join(map(str, row))}
        yield IntegrityFinding("references", f"{column.name} is {value}, and {target} has no such row", RESTORE, place)
    if count > _MOST:
        message = f"{count - _MOST} further rows whose {column.name} leads nowhere"
        yield IntegrityFinding("references", message, RESTORE, {"table": table})
