"""Alembic runs this: one connection, one transaction, whichever the engine."""

from __future__ import annotations

from alembic import context
from pyroshock.schema.tables import metadata

engine = context.config.attributes["engine"].execution_options(pyroshock_writes=True)
#: Any number will do that no other program on the server takes.
MIGRATION_LOCK = 0x5EED

with engine.connect() as connection:
    if connection.dialect.name == "postgresql":
        # Two commands may find the same empty database; SQLite's writers queue by themselves.
        connection.exec_driver_sql(f"SELECT pg_advisory_xact_lock({MIGRATION_LOCK})")
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
    connection.commit()
