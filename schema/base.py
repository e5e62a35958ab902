"""What all tables share: names of constraints, aware UTC times, exact numbers, who wrote a row, and
JSON that both engines take.

`to_plain` and `from_plain` are inverse on what JSON can say plus non-finite numbers; numpy scalars
and arrays become Python's, tuples lists, and what is no character (lone surrogates, NUL) a question
mark or the replacement character.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from datetime import UTC, datetime
from typing import Any, TypeVar

from sqlalchemy import (
    JSON,
    BigInteger,
    DateTime,
    Dialect,
    ForeignKey,
    Index,
    Integer,
    MetaData,
    Table,
    text,
)
from sqlalchemy.orm import DeclarativeBase, Mapped, declared_attr, mapped_column
from sqlalchemy.types import TypeDecorator

from .row_hashes import hash_on_insert, mark_on_update
from .row_keys import key_on_insert
from .row_sealing import MARKED

Value = TypeVar("Value")

_FLOAT = "$float"  # JSON has no NaN, and PostgreSQL refuses Python's


def to_plain(value: Any) -> Any:
    """`value` as JSON types only. Raises `TypeError` for what has no such form."""
    if value is None or isinstance(value, bool | int):
        return value
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else {_FLOAT: repr(float(value))}
    if isinstance(value, str):
        return value.encode("utf-8", "replace").decode("utf-8").replace("\x00", "\ufffd")
    if isinstance(value, dict):
        return {to_plain(str(key)): to_plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [to_plain(item) for item in value]
    if hasattr(value, "tolist"):  # numpy's scalars and arrays
        return to_plain(value.tolist())
    raise TypeError(f"{type(value).__name__} {value!r} cannot be stored as JSON")


def from_plain(value: Any) -> Any:
    """The inverse of `to_plain`."""
    if isinstance(value, dict):
        if value.keys() == {_FLOAT}:
            return float(value[_FLOAT])
        return {key: from_plain(item) for key, item in value.items()}
    return [from_plain(item) for item in value] if isinstance(value, list) else value


#: Constraint names are spelled out so that a migration can drop what another engine created.
NAMING = {
    "ix": "ix_%(table_name)s_%(column_0_N_name)s",
    "uq": "uq_%(table_name)s_%(column_0_N_name)s",
    "ck": "ck_%(table_name)s_%(constraint_name)s",
    "fk": "fk_%(table_name)s_%(column_0_name)s_%(referred_table_name)s",
    "pk": "pk_%(table_name)s",
}


#: A number beyond two thousand millions, such as a size in bytes; SQLite's integers are as long
#: anyway.
LONG = BigInteger().with_variant(Integer(), "sqlite")


class UtcDateTime(TypeDecorator[datetime]):
    """An aware time, kept in UTC. A naive one is refused: nobody knows later which clock it
    meant."""

    impl = DateTime(timezone=True)
    cache_ok = True

    def process_bind_param(self, value: datetime | None, _dialect: Dialect) -> datetime | None:
        if value is None:
            return None
        if value.tzinfo is None:
            raise ValueError(f"naive time {value.isoformat()} refused: give it a time zone")
        return value.astimezone(UTC)

    def process_result_value(self, value: datetime | None, _dialect: Dialect) -> datetime | None:
        if value is None:
            return None
        # SQLite forgets the zone; what was written was UTC.
        return value.replace(tzinfo=UTC) if value.tzinfo is None else value.astimezone(UTC)


class PlainJson(TypeDecorator[Any]):
    """JSON, with NaN and infinities (see `plain`)."""

    impl = JSON
    cache_ok = True

    def process_bind_param(self, value: Any, _dialect: Dialect) -> Any:
        return to_plain(value)

    def process_result_value(self, value: Any, _dialect: Dialect) -> Any:
        return from_plain(value)


class Base(DeclarativeBase):
    """Root of every table."""

    metadata = MetaData(naming_convention=NAMING)
    type_annotation_map = {datetime: UtcDateTime, dict[str, Any]: PlainJson, list[Any]: PlainJson}  # noqa: RUF012

    #: See `row_hashes`. Not read with the row, for in SQLite it lies behind the row's frames.
    row_sha256: Mapped[str | None] = mapped_column(
        default=hash_on_insert, onupdate=mark_on_update, deferred=True, sort_order=1000
    )

    def __init_subclass__(cls, **options: Any) -> None:
        super().__init_subclass__(**options)
        table = cls.__table__
        assert isinstance(table, Table)
        # "which rows does this transaction still have to seal"
        name, marked = f"ix_{table.name}_unsealed", text(MARKED)
        Index(name, *table.primary_key.columns, sqlite_where=marked, postgresql_where=marked)

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {getattr(self, 'id', '?')}>"


class HasId:
    """A surrogate key."""

    id: Mapped[int] = mapped_column(primary_key=True, autoincrement=True, default=key_on_insert)


class WithProvenance:
    """Every row knows the software version and the command that wrote it.

    Filled by `session.Store.writing`; a row added outside of it is refused by the not-null rule.
    """

    @declared_attr
    def written_by_id(cls) -> Mapped[int]:
        return mapped_column(ForeignKey("provenance.id"))


#: Key of a column's `info`: what the column is called where a finding names its row.
NAMES_ROW = "names_row"


def names_row(label: str) -> dict[str, str]:
    """The `info` of a column by which people know a row: what a finding calls it, such as
    "campaign"."""
    return {NAMES_ROW: label}


def positive(column: str) -> str:
    """SQL of the rule "missing, or above zero"."""
    return f"{column} IS NULL OR {column} > 0"


def not_negative(column: str) -> str:
    """SQL of the rule "missing, or zero and above"."""
    return f"{column} IS NULL OR {column} >= 0"


def one_of(column: str, values: tuple[str, ...]) -> str:
    """SQL of the rule "missing, or one of these words"."""
    return f"{column} IN ({', '.join(repr(v) for v in values)})"


#: Of values in one statement: SQLite takes a limited number of variables.
_AT_ONCE = 500


def in_batches(values: Sequence[Value]) -> Iterator[Sequence[Value]]:
    """As many of `values` at a time as a statement takes."""
    for first in range(0, len(values), _AT_ONCE):
        yield values[first : first + _AT_ONCE]
