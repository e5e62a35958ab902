"""SQLite takes any value into any column: each is of its column's kind, as PostgreSQL enforces it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from sqlalchemy import Column, ColumnElement, Connection, Integer, and_, cast, func, or_, select

from ..findings import IntegrityFinding
from ..kinds import BYTES, DAY, INTEGER, JSON_TEXT, NUMBER, TEXT, TIME, TRUTH, kind_of
from .scope import RESTORE, Scope
from .tables import tables_there

_STORED_AS = {
    INTEGER: ("integer",),
    NUMBER: ("real", "integer"),
    TEXT: ("text",),
    JSON_TEXT: ("text", "integer", "real"),  # of a JSON number the file keeps the number
    TRUTH: ("integer",),
    TIME: ("text",),
    DAY: ("text",),
    BYTES: ("blob",),
}
#: As SQLAlchemy writes them, and reads them back.
_FORMS = {TIME: "____-__-__ __:__:__.______", DAY: "____-__-__"}


def check_values(connection: Connection, _: Scope) -> Iterator[IntegrityFinding]:
    """Columns of an SQLite file that hold something of another kind."""
    if connection.dialect.name != "sqlite":
        return
    for table in tables_there(connection):
        columns = list(table.columns)
        counts = connection.execute(
            select(*(func.count().filter(_wrong(column)) for column in columns)).select_from(table)
        ).one()
        for column, count in zip(columns, counts, strict=True):
            if count:
                message = f"{count} rows hold no {kind_of(column)} in {column.name}"
                yield IntegrityFinding("values", message, RESTORE, {"table": table.name})


def _wrong(column: Column[Any]) -> ColumnElement[bool]:
    kind, raw = kind_of(column), func.typeof(column)
    allowed = (*_STORED_AS[kind], *(("null",) if column.nullable else ()))
    wrong: list[ColumnElement[bool]] = [raw.not_in(allowed)]
    if kind in (TEXT, JSON_TEXT):
        wrong.append(func.instr(column, func.char(0)) > 0)
    if kind == JSON_TEXT:
        wrong.append(and_(column.is_not(None), func.json_valid(column) == 0))
    if kind in _FORMS:
        wrong.append(and_(raw == "text", or_(func.like(_FORMS[kind], column) == 0, func.julianday(column).is_(None))))
    if kind == TRUTH:
        wrong.append(and_(raw == "integer", cast(column, Integer).not_in((0, 1))))
    return or_(*wrong)
