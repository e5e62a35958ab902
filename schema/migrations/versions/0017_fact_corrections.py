"""facts of stored campaigns are added and corrected with a reason, and the earlier value is kept"""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0017"
down_revision = "0016"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.create_table(
        "fact_corrections",
        sa.Column("campaign_id", sa.Integer(), nullable=False),
        sa.Column("fact", sa.String(), nullable=False),
        sa.Column("earlier", sa.JSON(), nullable=False),
        sa.Column("value", sa.String(), nullable=False),
        sa.Column("reason", sa.String(), nullable=False),
        sa.Column("corrected_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("id", sa.Integer(), autoincrement=True, nullable=False),
        sa.Column("written_by_id", sa.Integer(), nullable=False),
        sa.Column("row_sha256", sa.String()),
        sa.CheckConstraint("length(reason) > 0", name="with_reason"),
        sa.CheckConstraint("length(fact) > 0", name="fact_named"),
        sa.PrimaryKeyConstraint("id", name="pk_fact_corrections"),
        sa.ForeignKeyConstraint(
            ["campaign_id"],
            ["campaigns.id"],
            name="fk_fact_corrections_campaign_id_campaigns",
        ),
        sa.ForeignKeyConstraint(
            ["written_by_id"],
            ["provenance.id"],
            name="fk_fact_corrections_written_by_id_provenance",
        ),
    )
    op.create_index("ix_fact_corrections_campaign_id", "fact_corrections", ["campaign_id"])
    unsealed = sa.text("row_sha256 = 'unsealed'")
    op.create_index(
        "ix_fact_corrections_unsealed",
        "fact_corrections",
        ["id"],
        sqlite_where=unsealed,
        postgresql_where=unsealed,
    )
