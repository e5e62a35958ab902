"""Kinds of columns: how a value of each SQL type is stored, copied, checked and hashed."""

from __future__ import annotations

from typing import Any

from sqlalchemy import (
    JSON,
    Boolean,
    Column,
    Date,
    DateTime,
    Float,
    Integer,
    LargeBinary,
    String,
    Text,
)
from sqlalchemy.types import TypeDecorator

INTEGER, NUMBER, TEXT, JSON_TEXT, TRUTH, TIME, DAY, BYTES = (
    "integer",
    "number",
    "text",
    "json",
    "truth",
    "time",
    "day",
    "bytes",
)
_KINDS: tuple[tuple[type[Any], str], ...] = (
    (JSON, JSON_TEXT),
    (LargeBinary, BYTES),
    (Boolean, TRUTH),
    (Integer, INTEGER),
    (Float, NUMBER),
    (DateTime, TIME),
    (Date, DAY),
    (String, TEXT),
)


def kind_of(column: Column[Any]) -> str:
    """One of the kinds above. Raises `TypeError` for a type that no table had when this was
    written."""
    own = column.type.impl_instance if isinstance(column.type, TypeDecorator) else column.type
    for known_type, kind in _KINDS:
        if isinstance(own, known_type):
            return kind
    raise TypeError(
        f"{column} is a {own!r}: say in schema/column_kinds.py how it is copied and checked"
    )


def stored_type(column: Column[Any]) -> Any:
    """The type by which a value is read and written as it is stored: JSON is its text, so that
    nothing is rewritten."""
    return Text() if kind_of(column) == JSON_TEXT else column.type
