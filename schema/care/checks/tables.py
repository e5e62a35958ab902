"""The tables are those that this software reads and writes."""

from __future__ import annotations

from collections.abc import Iterator

from sqlalchemy import Connection, Table, inspect

from ...tables import metadata
from ..findings import IntegrityFinding
from .scope import RESTORE, Scope


def tables_there(connection: Connection) -> list[Table]:
    """The tables of ours that the store has: one that is missing keeps no other from being looked at."""
    names = set(inspect(connection).get_table_names())
    return [table for table in metadata.sorted_tables if table.name in names]


def check_tables(connection: Connection, _: Scope) -> Iterator[IntegrityFinding]:
    """Tables, columns and indices that are missing: somebody has taken them away by hand."""
    there = inspect(connection)
    names = set(there.get_table_names())
    for table in metadata.sorted_tables:
        if table.name not in names:
            yield IntegrityFinding("tables", "the table is missing", RESTORE, {"table": table.name})
            continue
        columns = {column["name"] for column in there.get_columns(table.name)}
        indices = {index["name"] for index in there.get_indexes(table.name)}
        missing = [f"column {column.name}" for column in table.columns if column.name not in columns]
        missing += [f"index {index.name}" for index in table.indexes if index.name not in indices]
        for what in sorted(missing):
            yield IntegrityFinding("tables", f"{what} is missing", RESTORE, {"table": table.name})
