"""Values that one engine keeps and the other cannot: found before a copy, named by table and column."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from sqlalchemy import BigInteger, Column, ColumnElement, Connection, Table, func, select

from ..engine import StoreError
from .kinds import INTEGER, JSON_TEXT, NUMBER, TEXT, kind_of

_LARGEST = 2**31 - 1


def refuse_unholdable(connection: Connection, table: Table, engine: str) -> None:
    """Raise `StoreError` where a row of `table` holds what `engine` ("sqlite", "postgresql") cannot."""
    if connection.dialect.name == engine:
        return
    suspects = list((_postgres_cannot if engine == "postgresql" else _sqlite_cannot)(table))
    if not suspects:
        return
    counts = connection.execute(
        select(*(func.count().filter(rule) for _, rule, _ in suspects)).select_from(table)
    ).one()
    for (column, _, what), count in zip(suspects, counts, strict=True):
        if count:
            raise StoreError(f"{table.name}.{column.name} holds {what} in {count} rows, which {engine} cannot keep")


def _sqlite_cannot(table: Table) -> Iterator[tuple[Column[Any], ColumnElement[bool], str]]:
    for column in table.columns:
        if kind_of(column) == NUMBER:
            yield column, column == float("nan"), "NaN"


def _postgres_cannot(table: Table) -> Iterator[tuple[Column[Any], ColumnElement[bool], str]]:
    for column in table.columns:
        kind = kind_of(column)
        if kind == INTEGER and not isinstance(column.type, BigInteger) and not column.foreign_keys:
            yield column, ~column.between(-_LARGEST - 1, _LARGEST), f"a number beyond {_LARGEST}"
        elif kind in (TEXT, JSON_TEXT):
            yield column, func.instr(column, func.char(0)) > 0, "a NUL character"
