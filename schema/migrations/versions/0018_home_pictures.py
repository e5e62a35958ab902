"""the pictures of the first page are chosen and ordered by the laboratory"""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0018"
down_revision = "0017"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.create_table(
        "home_pictures",
        sa.Column("id", sa.Integer(), autoincrement=True, nullable=False),
        sa.Column("picture", sa.String(), nullable=False),
        sa.Column("position", sa.Integer(), nullable=False),
        sa.Column("written_by_id", sa.Integer(), nullable=False),
        sa.Column("row_sha256", sa.String()),
        sa.PrimaryKeyConstraint("id", name="pk_home_pictures"),
        sa.ForeignKeyConstraint(
            ["written_by_id"], ["provenance.id"], name="fk_home_pictures_written_by_id_provenance"
        ),
        sa.UniqueConstraint("picture", name="uq_home_pictures_picture"),
        sa.UniqueConstraint("position", name="uq_home_pictures_position"),
        sa.CheckConstraint("length(picture) > 0", name=op.f("ck_home_pictures_picture_not_empty")),
        sa.CheckConstraint("position > 0", name=op.f("ck_home_pictures_position_positive")),
    )
    unsealed = sa.text("row_sha256 = 'unsealed'")
    op.create_index(
        "ix_home_pictures_unsealed",
        "home_pictures",
        ["id"],
        sqlite_where=unsealed,
        postgresql_where=unsealed,
    )
    connection = op.get_bind()
    if connection.dialect.name == "postgresql":
        from pyroshock.schema.access.permissions import missing_roles
        from pyroshock.schema.access.roles import grant_rights

        # Without CREATEROLE there are no roles: `pyroshock db roles` makes them, and grants.
        if not missing_roles(connection):
            grant_rights(connection)
