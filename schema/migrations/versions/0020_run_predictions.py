"""predictions of planned runs are stored before their shots, and each hit has the time at which it
was stored"""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0020"
down_revision = "0019"
branch_labels = None
depends_on = None

_QUANTITIES = (
    ("velocity_m_s", "velocity_lower_m_s", "velocity_upper_m_s"),
    ("contact_time_s", "contact_time_lower_s", "contact_time_upper_s"),
    ("peak_force_n", "peak_force_lower_n", "peak_force_upper_n"),
)


def _ordered(median: str, lower: str, upper: str) -> sa.CheckConstraint:
    return sa.CheckConstraint(
        f"({median} IS NULL AND {lower} IS NULL AND {upper} IS NULL) OR "
        f"({lower} IS NOT NULL AND {upper} IS NOT NULL AND {median} IS NOT NULL "
        f"AND {lower} <= {median} AND {median} <= {upper})",
        name=f"{median}_ordered",
    )


def upgrade() -> None:
    # Hits that are there have none: nobody knows it, and no prediction is older than they are.
    for table in ("impacts", "shots"):
        op.add_column(table, sa.Column("stored_at", sa.DateTime(timezone=True)))
    op.create_table(
        "run_predictions",
        sa.Column("planned_run_id", sa.Integer(), nullable=False),
        sa.Column("made_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("campaign", sa.String()),
        sa.Column("models", sa.JSON(), nullable=False),
        sa.Column("adopted", sa.JSON(), nullable=False),
        sa.Column("settings", sa.JSON(), nullable=False),
        sa.Column("options", sa.JSON(), nullable=False),
        sa.Column("draws", sa.Integer(), nullable=False),
        sa.Column("seed", sa.Integer(), nullable=False),
        *(sa.Column(name, sa.Double()) for names in _QUANTITIES for name in names),
        sa.Column("drawn", sa.JSON(), nullable=False),
        sa.Column("spectra", sa.JSON()),
        sa.Column("warnings", sa.JSON(), nullable=False),
        sa.Column("remarks", sa.JSON(), nullable=False),
        sa.Column("id", sa.Integer(), autoincrement=True, nullable=False),
        sa.Column("written_by_id", sa.Integer(), nullable=False),
        sa.Column("row_sha256", sa.String()),
        *(_ordered(*names) for names in _QUANTITIES),
        sa.CheckConstraint("draws >= 1", name="draws_positive"),
        sa.PrimaryKeyConstraint("id", name="pk_run_predictions"),
        sa.UniqueConstraint(
            "planned_run_id", "made_at", name="uq_run_predictions_planned_run_id_made_at"
        ),
        sa.ForeignKeyConstraint(
            ["planned_run_id"],
            ["planned_runs.id"],
            name="fk_run_predictions_planned_run_id_planned_runs",
        ),
        sa.ForeignKeyConstraint(
            ["written_by_id"],
            ["provenance.id"],
            name="fk_run_predictions_written_by_id_provenance",
        ),
    )
    unsealed = sa.text("row_sha256 = 'unsealed'")
    op.create_index(
        "ix_run_predictions_unsealed",
        "run_predictions",
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
