"""Names are one short line, paths stay in their folder, JSON has the form that its readers expect.

What our own commands see to; looked at in files from elsewhere.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import PurePosixPath
from typing import Any

from sqlalchemy import Column, Connection, select

from ...json_floats import from_plain
from ...tables import metadata
from ..findings import IntegrityFinding
from ..kinds import JSON_TEXT, kind_of
from ..rows import iter_batches
from .json_shapes import fits
from .scope import Scope

_ADVICE = "ask for another export"
_NAMES = frozenset({"name", "label", "alias", "path", "channel", "check", "simulator", "method", "quantity", "unit"})
_LONGEST = 1000


def check_names(connection: Connection, _: Scope) -> Iterator[IntegrityFinding]:
    """Names that no line can show, paths that lead out of the campaign's folder, JSON of another form."""
    for table in metadata.sorted_tables:
        for column in table.columns:
            if column.name in _NAMES and kind_of(column) != JSON_TEXT:
                yield from _names(connection, column)
        yield from _json(connection, table)


def _names(connection: Connection, column: Column[Any]) -> Iterator[IntegrityFinding]:
    for text in connection.scalars(select(column).distinct().where(column.is_not(None))):
        if len(text) > _LONGEST or not text.isprintable():
            message = f"{column.name} is {text!r:.60}; expected one line of at most {_LONGEST} characters"
            yield IntegrityFinding("names", message, _ADVICE, {"table": column.table.name})
        elif column.name == "path" and (PurePosixPath(text).is_absolute() or ".." in PurePosixPath(text).parts):
            message = f"path {text!r:.60} leads out of the campaign's folder"
            yield IntegrityFinding("names", message, _ADVICE, {"table": column.table.name})


def _json(connection: Connection, table: Any) -> Iterator[IntegrityFinding]:
    columns = list(table.columns)
    places = [i for i, column in enumerate(columns) if kind_of(column) == JSON_TEXT]
    if not places:
        return
    for batch in iter_batches(connection, table):
        for row in batch:
            for place in places:
                problem = _problem(columns[place], row[place])
                if problem is not None:
                    yield IntegrityFinding("names", problem, _ADVICE, {"table": table.name})


def _problem(column: Column[Any], stored: str | None) -> str | None:
    if stored is None:
        return None
    try:
        value = from_plain(json.loads(stored))
    except (ValueError, RecursionError, TypeError) as error:
        return f"{column.name} cannot be read: {type(error).__name__}"
    return None if fits(str(column), value) else f"{column.name} has not the form that is expected there"
