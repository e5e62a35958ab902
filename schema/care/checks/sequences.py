"""PostgreSQL gives the next row a key that is free."""

from __future__ import annotations

from collections.abc import Iterator

from sqlalchemy import Connection

from ..findings import IntegrityFinding
from ..sequences import iter_lagging
from .scope import Scope


def check_sequences(connection: Connection, _: Scope) -> Iterator[IntegrityFinding]:
    """Counters behind the largest key: the next insert would be refused."""
    for key, last, given in iter_lagging(connection):
        table = key.table.name
        advice = f"run: SELECT setval(pg_get_serial_sequence('{table}', '{key.name}'), {last})"
        yield IntegrityFinding(
            "sequences", f"the counter stands at {given or 0}, the largest key is {last}", advice, {"table": table}
        )
