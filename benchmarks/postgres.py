"""PostgreSQL databases for a measurement: empty ones, gone after it, and others that are kept for the next."""

from __future__ import annotations

import os
import uuid
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from sqlalchemy import URL, make_url

#: The tests' own: a PostgreSQL server in which databases may be made.
SERVER_VARIABLE = "TEST_DATABASE_URL"


@contextmanager
def server() -> Iterator[str]:
    """The address of the named server, or of one that is started with settings that keep what was committed."""
    named = os.environ.get(SERVER_VARIABLE)
    if named:
        yield make_url(named).set(drivername="postgresql+psycopg").render_as_string(hide_password=False)
        return
    from .shared_records import running_server

    with running_server(durable=True) as url:
        yield url


def kept_database(server_url: str, name: str, make: Callable[[str], None]) -> str:
    """The address of the database of this name, made where the server lacks it; one that is half made is made anew."""
    server = make_url(server_url).set(drivername="postgresql+psycopg")
    address = server.set(database=name).render_as_string(hide_password=False)
    if not _execute(server, "SELECT FROM pg_database WHERE datname = %s", name):
        unfinished = f"{name}_unfinished"
        _execute(server, f'DROP DATABASE IF EXISTS "{unfinished}" WITH (FORCE)')
        _execute(server, f'CREATE DATABASE "{unfinished}"')
        make(server.set(database=unfinished).render_as_string(hide_password=False))
        _execute(server, f'ALTER DATABASE "{unfinished}" RENAME TO "{name}"')
    return address


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


def _execute(server: URL, statement: str, *values: str) -> int:
    """Rows that the statement found or changed."""
    import psycopg

    address = server.set(drivername="postgresql").render_as_string(hide_password=False)
    with psycopg.connect(address, autocommit=True) as connection:
        return connection.execute(statement.encode(), values).rowcount
