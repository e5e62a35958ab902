"""Alembic runs this: one connection, one transaction, whichever the engine."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from alembic import context
from pyroshock.schema.access.roles import act_as_owner
from pyroshock.schema.migrate import MIGRATION_LOCK
from pyroshock.schema.tables import metadata
from sqlalchemy import Connection, func, select

given = context.config.attributes.get("connection")  # within a caller's transaction


@contextmanager
def opened() -> Iterator[Connection]:
    """The caller's connection, or one of its own that is committed."""
    if given is not None:
        yield given
        return
    engine = context.config.attributes["engine"].execution_options(pyroshock_writes=True)
    with engine.connect() as connection, foreign_keys_later(connection), connection.begin():
        yield connection
        if connection.dialect.name == "sqlite":
            broken = connection.exec_driver_sql("PRAGMA foreign_key_check").first()
            if broken is not None:
                raise RuntimeError(
                    f"a migration left table {broken[0]!r} with "
                    f"a reference to no row; nothing was changed"
                )


@contextmanager
def foreign_keys_later(connection: Connection) -> Iterator[None]:
    """SQLite alters a table by making it anew, and dropping the old one would break all references
    to it.

    Within a transaction the rule cannot be suspended, so it is around it, and every reference is
    looked at in the end.
    """
    if connection.dialect.name != "sqlite":
        yield
        return
    plain: Any = connection.connection.dbapi_connection
    plain.execute("PRAGMA foreign_keys = OFF")
    try:
        yield
    finally:
        plain.execute("PRAGMA foreign_keys = ON")


with opened() as connection:
    if connection.dialect.name == "postgresql":
        # Two commands may find the same empty database; SQLite's writers queue by themselves.
        connection.execute(select(func.pg_advisory_xact_lock(MIGRATION_LOCK)))
        act_as_owner(connection)
    context.configure(
        connection=connection,
        target_metadata=metadata,
        transactional_ddl=True,  # SQLite has it too, once the driver leaves BEGIN to us
        transaction_per_migration=False,
        # SQLite cannot alter a table's rules in place: later migrations copy the table.
        render_as_batch=connection.dialect.name == "sqlite",
    )
    with context.begin_transaction():
        context.run_migrations()
