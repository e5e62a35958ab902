"""views of the page that explores the store are kept by name"""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0016"
down_revision = "0015"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.create_table(
        "saved_views",
        sa.Column("id", sa.Integer(), autoincrement=True, nullable=False),
        sa.Column("name", sa.String(), nullable=False),
        sa.Column("creator", sa.String()),
        sa.Column("request", sa.JSON(), nullable=False),
        sa.Column("saved_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("deleted_at", sa.DateTime(timezone=True)),
        sa.Column("written_by_id", sa.Integer(), nullable=False),
        sa.Column("row_sha256", sa.String()),
        sa.PrimaryKeyConstraint("id", name="pk_saved_views"),
        sa.ForeignKeyConstraint(
            ["written_by_id"], ["provenance.id"], name="fk_saved_views_written_by_id_provenance"
        ),
        sa.CheckConstraint("length(name) > 0", name=op.f("ck_saved_views_name_not_empty")),
    )
    present = sa.text("deleted_at IS NULL")
    op.create_index(
        "uq_saved_views_name",
        "saved_views",
        ["name"],
        unique=True,
        sqlite_where=present,
        postgresql_where=present,
    )
    unsealed = sa.text("row_sha256 = 'unsealed'")
    op.create_index(
        "ix_saved_views_unsealed",
        "saved_views",
        ["id"],
        sqlite_where=unsealed,
        postgresql_where=unsealed,
    )
