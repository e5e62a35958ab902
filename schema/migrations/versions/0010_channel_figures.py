"""channel figures: peak, durations, velocity change and spectrum's summary of each acceleration
channel of an impact

A store that is upgraded has none for what it holds: `pyroshock extract CAMPAIGN` measures them from
the stored series.
"""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op
from pyroshock.schema.access.roles import act_as_owner

revision = "0010"
down_revision = "0009"
branch_labels = None
depends_on = None

_TABLE = "channel_figures"
_RULES = {
    "peak_acceleration_positive": "peak_acceleration_m_s2 > 0",
    "pulse_duration_not_negative": "pulse_duration_s IS NULL OR pulse_duration_s >= 0",
    "effective_duration_not_negative": "effective_duration_s IS NULL OR effective_duration_s >= 0",
    "energy_duration_not_negative": "energy_duration_s IS NULL OR energy_duration_s >= 0",
}
_NUMBERS = (
    "peak_acceleration_m_s2 signed_peak_acceleration_m_s2 peak_time_s "
    "pulse_start_s pulse_duration_s "
    "effective_duration_s energy_duration_s velocity_change_m_s record_velocity_change_m_s"
)


def upgrade() -> None:
    if op.get_bind().dialect.name == "postgresql":
        act_as_owner(op.get_bind())  # 0005 may have handed the tables over in this very transaction
    references = {
        "impact_id": "impacts.id",
        "channel_id": "channels.id",
        "written_by_id": "provenance.id",
    }
    op.create_table(
        _TABLE,
        sa.Column("impact_id", sa.Integer(), nullable=False),
        sa.Column("channel_id", sa.Integer(), nullable=False),
        sa.Column("largest", sa.Boolean(), nullable=False),
        sa.Column("rest_m_s2", sa.Double(), nullable=True),
        *(sa.Column(name, sa.Double(), nullable=False) for name in _NUMBERS.split()),
        sa.Column("srs_frequency_hz", sa.JSON(), nullable=False),
        sa.Column("srs_maximax_m_s2", sa.JSON(), nullable=False),
        sa.Column("srs_peak_m_s2", sa.Double(), nullable=True),
        sa.Column("srs_peak_frequency_hz", sa.Double(), nullable=True),
        sa.Column("figures_sha256", sa.String(), nullable=True),
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("written_by_id", sa.Integer(), nullable=False),
        *(
            sa.CheckConstraint(rule, name=op.f(f"ck_{_TABLE}_{name}"))
            for name, rule in _RULES.items()
        ),
        *(
            sa.ForeignKeyConstraint(
                [column], [target], name=op.f(f"fk_{_TABLE}_{column}_{target.split('.')[0]}")
            )
            for column, target in references.items()
        ),
        sa.PrimaryKeyConstraint("id", name=op.f(f"pk_{_TABLE}")),
        sa.UniqueConstraint(
            "impact_id", "channel_id", name=op.f(f"uq_{_TABLE}_impact_id_channel_id")
        ),
    )
    op.create_index(f"ix_{_TABLE}_channel_id", _TABLE, ["channel_id"])
    largest = sa.text("largest")
    op.create_index(
        f"uq_{_TABLE}_largest",
        _TABLE,
        ["impact_id"],
        unique=True,
        sqlite_where=largest,
        postgresql_where=largest,
    )


def downgrade() -> None:
    """Measured from the stored series, and can be again."""
    op.drop_table(_TABLE)
