"""roles: reader, operator and admin of a store on PostgreSQL"""

from __future__ import annotations

from alembic import op

revision = "0005"
down_revision = "0004"
branch_labels = None
depends_on = None


def upgrade() -> None:
    connection = op.get_bind()
    if connection.dialect.name == "postgresql":
        from pyroshock.schema.access.roles import grant_roles

        grant_roles(
            connection
        )  # without CREATEROLE there are none: `pyroshock db roles` says so, and makes them


def downgrade() -> None:
    connection = op.get_bind()
    if connection.dialect.name == "postgresql":
        from pyroshock.schema.access.roles import revoke_roles

        revoke_roles(connection)
