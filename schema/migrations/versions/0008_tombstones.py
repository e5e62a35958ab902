"""tombstones: what was deleted, why, and what stood on it"""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op
from pyroshock.schema.access.roles import act_as_owner

revision = "0008"
down_revision = "0007"
branch_labels = None
depends_on = None


def upgrade() -> None:
    if op.get_bind().dialect.name == "postgresql":
        act_as_owner(op.get_bind())  # 0005 may have handed the tables over in this very transaction
    op.create_table(
        "tombstones",
        sa.Column("kind", sa.String(), nullable=False),
        sa.Column("campaign", sa.String(), nullable=False),
        sa.Column("recording", sa.String(), nullable=True),
        sa.Column("content_hash", sa.String(), nullable=False),
        sa.Column("deleted_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("reason", sa.String(), nullable=False),
        sa.Column("counts", sa.JSON(), nullable=False),
        sa.Column("stood_on", sa.JSON(), nullable=False),
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("written_by_id", sa.Integer(), nullable=False),
        sa.CheckConstraint(
            "kind IN ('campaign', 'recording')", name=op.f("ck_tombstones_kind_known")
        ),
        sa.CheckConstraint(
            "length(content_hash) = 64", name=op.f("ck_tombstones_content_hash_length")
        ),
        sa.CheckConstraint(
            "(kind = 'recording') = (recording IS NOT NULL)",
            name=op.f("ck_tombstones_recording_named"),
        ),
        sa.CheckConstraint("length(reason) > 0", name=op.f("ck_tombstones_with_reason")),
        sa.ForeignKeyConstraint(
            ["written_by_id"],
            ["provenance.id"],
            name=op.f("fk_tombstones_written_by_id_provenance"),
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_tombstones")),
    )


def downgrade() -> None:
    """What was deleted is no longer told."""
    op.drop_table("tombstones")
