"""known facts: what a laboratory measured of its own bench, with uncertainty and source, in its
campaign's row"""

from __future__ import annotations

import sqlite3

import sqlalchemy as sa
from alembic import op
from pyroshock.schema.row_sealing import iter_hashed, seal_table

revision = "0013"
down_revision = "0012"
branch_labels = None
depends_on = None


def upgrade() -> None:
    connection = op.get_bind()
    if connection.dialect.name != "postgresql":
        op.add_column("campaigns", sa.Column("known_facts", sa.JSON(), nullable=True))
        return
    from pyroshock.schema.access.permissions import missing_roles
    from pyroshock.schema.access.roles import act_as_owner, grant_rights

    act_as_owner(connection)
    op.add_column("campaigns", sa.Column("known_facts", sa.JSON(), nullable=True))
    if not missing_roles(connection):
        grant_rights(connection)  # an operator completes a campaign's facts


def downgrade() -> None:
    """The facts are lost. Rows that had some are hashed anew, where they were as their hash
    said."""
    connection = op.get_bind()
    if connection.dialect.name == "postgresql":
        from pyroshock.schema.access.roles import act_as_owner

        act_as_owner(connection)
    table = _campaigns()
    sound = [
        row.values["id"]
        for rows in iter_hashed(connection, table, table.c.known_facts.is_not(None))
        for row in rows
        if row.recorded == row.computed
    ]
    if connection.dialect.name == "sqlite" and sqlite3.sqlite_version_info >= (3, 35):
        op.execute("ALTER TABLE campaigns DROP COLUMN known_facts")
    else:
        with op.batch_alter_table("campaigns", schema=None) as batch_op:
            batch_op.drop_column("known_facts")
    if sound:
        table = _campaigns()
        seal_table(connection, table, table.c.id.in_(sound))


def _campaigns() -> sa.Table:
    """As it is in the store."""
    metadata = sa.MetaData()
    metadata.reflect(op.get_bind(), only=["campaigns"], resolve_fks=False)
    return metadata.tables["campaigns"]
