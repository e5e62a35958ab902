"""Empty PostgreSQL databases for a measurement, gone after it."""

from __future__ import annotations

import uuid
from collections.abc import Iterator
from contextlib import contextmanager

from sqlalchemy import URL, make_url


@contextmanager
def empty_databases(server_url: str, count: int) -> Iterator[list[str]]:
    """Addresses of `count` new databases on the server at `server_url`."""
    server = make_url(server_url).set(drivername="postgresql+psycopg")
    names = [f"pyroshock_bench_{uuid.uuid4().hex}" for _ in range(count)]
    for name in names:
        _execute(server, f'CREATE DATABASE "{name}"')
    try:
        yield [server.set(database=name).render_as_string(hide_password=False) for name in names]
    finally:
        for name in names:
            _execute(server, f'DROP DATABASE "{name}" WITH (FORCE)')


def _execute(server: URL, statement: str) -> None:
    import psycopg

    address = server.set(drivername="postgresql").render_as_string(hide_password=False)
    with psycopg.connect(address, autocommit=True) as connection:
        connection.execute(statement.encode())
