"""What the engine itself says: SQLite's pages and indices."""

from __future__ import annotations

from collections.abc import Iterator

from sqlalchemy import Connection, TextClause, text

from ..findings import IntegrityFinding
from .scope import RESTORE, Scope

_WHOLE, _PAGES = text("PRAGMA integrity_check(20)"), text("PRAGMA quick_check(20)")


def check_database(connection: Connection, _: Scope) -> Iterator[IntegrityFinding]:
    """Every page and index of an SQLite file. PostgreSQL checks its pages by its own means."""
    yield from _told(connection, _WHOLE)


def check_pages(connection: Connection, _: Scope) -> Iterator[IntegrityFinding]:
    """`check_database` without comparing indices to their tables: a third of the time."""
    yield from _told(connection, _PAGES)


def _told(connection: Connection, question: TextClause) -> Iterator[IntegrityFinding]:
    if connection.dialect.name != "sqlite":
        return
    for line in connection.scalars(question):
        if line != "ok":
            yield IntegrityFinding("database", str(line), RESTORE)
