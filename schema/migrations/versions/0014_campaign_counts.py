"""the numbers of impacts and shots of each campaign are kept

Campaigns without a row are counted when their numbers are asked for; `pyroshock db upgrade` writes
the rows after the last revision.
"""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0014"
down_revision = "0013"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.create_table(
        "campaign_counts",
        sa.Column("campaign_id", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("impacts", sa.Integer(), nullable=False),
        sa.Column("shots", sa.Integer(), nullable=False),
        sa.Column("row_sha256", sa.String()),
        sa.PrimaryKeyConstraint("campaign_id", name="pk_campaign_counts"),
        sa.ForeignKeyConstraint(
            ["campaign_id"],
            ["campaigns.id"],
            name="fk_campaign_counts_campaign_id_campaigns",
            ondelete="CASCADE",
        ),
    )
    unsealed = sa.text("row_sha256 = 'unsealed'")
    op.create_index(
        "ix_campaign_counts_unsealed",
        "campaign_counts",
        ["campaign_id"],
        sqlite_where=unsealed,
        postgresql_where=unsealed,
    )
