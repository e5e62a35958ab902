"""adopted effects: versions of the twin's configuration"""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0002"
down_revision = "0001"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.create_table(
        "twin_configurations",
        sa.Column("version", sa.Integer(), nullable=False),
        sa.Column("campaign_id", sa.Integer(), nullable=False),
        sa.Column("diagnosis_id", sa.Integer(), nullable=True),
        sa.Column("adopted_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("reason", sa.String(), nullable=False),
        sa.Column("configuration", sa.JSON(), nullable=False),
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("written_by_id", sa.Integer(), nullable=False),
        sa.CheckConstraint(
            "version IS NULL OR version > 0", name=op.f("ck_twin_configurations_version_positive")
        ),
        sa.ForeignKeyConstraint(
            ["campaign_id"],
            ["campaigns.id"],
            name=op.f("fk_twin_configurations_campaign_id_campaigns"),
        ),
        sa.ForeignKeyConstraint(
            ["diagnosis_id"],
            ["diagnoses.id"],
            name=op.f("fk_twin_configurations_diagnosis_id_diagnoses"),
        ),
        sa.ForeignKeyConstraint(
            ["written_by_id"],
            ["provenance.id"],
            name=op.f("fk_twin_configurations_written_by_id_provenance"),
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_twin_configurations")),
        sa.UniqueConstraint("version", name=op.f("uq_twin_configurations_version")),
    )
    with op.batch_alter_table("twin_configurations", schema=None) as batch_op:
        batch_op.create_index(
            batch_op.f("ix_twin_configurations_campaign_id"), ["campaign_id"], unique=False
        )


def downgrade() -> None:
    with op.batch_alter_table("twin_configurations", schema=None) as batch_op:
        batch_op.drop_index(batch_op.f("ix_twin_configurations_campaign_id"))
    op.drop_table("twin_configurations")
