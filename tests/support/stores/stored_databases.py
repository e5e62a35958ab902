"""Stores that an earlier version made, from the files of `tests/schema/stored`.

A revision's rows are a file of SQLite. On PostgreSQL the tables are those of a dump of revision
0013, moved up to the revision, and the rows are copied.
"""

from __future__ import annotations

import zlib
from contextlib import suppress
from pathlib import Path
from typing import Any

import psycopg
from pyroshock.schema import migrate
from pyroshock.schema.access.permissions import ROLES
from pyroshock.schema.session import make_engine
from sqlalchemy import JSON, MetaData, Text, TypeDecorator, cast, func, insert, make_url, select

from support.stores.many_databases import Databases

STORED = Path(__file__).resolve().parents[2] / "schema" / "stored"
#: The revision whose tables the dump holds.
DUMPED = "0013"


def stored_database(databases: Databases, folder: Path, revision: str = migrate.HEAD) -> str:
    """The address of a copy of the stored database of a revision."""
    file = folder / f"stored-{revision}.db"
    file.write_bytes(zlib.decompress((STORED / f"{revision}.sqlite.z").read_bytes()))
    stored = f"sqlite:///{file}"
    if databases.engine == "SQLite":
        return stored
    url = databases.empty()
    _restore_tables(url)
    source, target = make_engine(stored), make_engine(url)
    try:
        if revision != DUMPED:
            migrate.upgrade(target, revision)
        _copy_rows(source, target)
    finally:
        source.dispose()
        target.dispose()
    return url


def _restore_tables(url: str) -> None:
    address = make_url(url).set(drivername="postgresql").render_as_string(hide_password=False)
    tables = zlib.decompress((STORED / f"{DUMPED}.postgresql.sql.z").read_bytes())
    with psycopg.connect(address, autocommit=True) as connection:
        for role in ROLES:  # roles are the server's, and no part of a dump
            with suppress(psycopg.errors.DuplicateObject):
                connection.execute(f"CREATE ROLE {role} NOLOGIN".encode())
        connection.execute(tables)
        connection.execute(f"INSERT INTO public.alembic_version VALUES ('{DUMPED}')".encode())


class _StoredJson(TypeDecorator[str]):
    """JSON as its stored text, which a row's hash is of."""

    impl = Text
    cache_ok = True

    def bind_expression(self, bindvalue: Any) -> Any:
        return cast(bindvalue, JSON)


def _copy_rows(source: Any, target: Any) -> None:
    tables = MetaData()
    tables.reflect(target)  # the server's types: times with their zone
    of_source = MetaData()
    of_source.reflect(source)
    for column in (column for table in tables.sorted_tables for column in table.c):
        if isinstance(column.type, JSON):
            column.type = _StoredJson()
            of_source.tables[column.table.name].c[column.name].type = Text()
    with source.connect() as reading, target.begin() as writing:
        for table in tables.sorted_tables:
            query = select(of_source.tables[table.name])
            rows = [dict(row) for row in reading.execute(query).mappings()]
            if table.name == "alembic_version" or not rows:
                continue
            writing.execute(insert(table), rows)
            if "id" in table.c:
                counter = func.pg_get_serial_sequence(table.name, "id")
                writing.execute(select(func.setval(counter, max(row["id"] for row in rows))))


def dump(url: str) -> dict[str, list[str]]:
    """Every row of every table as it stands, whatever the revision."""
    engine = make_engine(url)
    try:
        tables = MetaData()
        tables.reflect(engine)
        with engine.connect() as connection:
            rows = {
                name: connection.execute(select(table)).all()
                for name, table in tables.tables.items()
            }
        return {name: sorted(map(repr, rows_of_table)) for name, rows_of_table in rows.items()}
    finally:
        engine.dispose()
