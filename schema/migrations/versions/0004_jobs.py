"""jobs: long work that outlives its worker"""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0004"
down_revision = "0003"
branch_labels = None
depends_on = None

_COUNTS = ("attempt", "deaths", "beat", "done", "total")
_RULES = {
    "state_known": "state IN ('waiting', 'running', 'done', 'failed', 'stopped')",
    "running_with_worker": "state <> 'running' OR (worker IS NOT "
    "NULL AND lease_s IS NOT NULL AND attempt > 0)",
    "lease_positive": "lease_s IS NULL OR lease_s > 0",
    "ended_when_over": "(ended_at IS NOT NULL) = (state IN ('done', 'failed', 'stopped'))",
    "failed_with_error": "(error IS NOT NULL) = (state = 'failed')",
    "done_with_address": "state <> 'done' OR address IS NOT NULL",
    **{f"{column}_not_negative": f"{column} IS NULL OR {column} >= 0" for column in _COUNTS},
}


def upgrade() -> None:
    op.create_table(
        "jobs",
        sa.Column("kind", sa.String(), nullable=False),
        sa.Column("label", sa.String(), nullable=False),
        sa.Column("arguments", sa.JSON(), nullable=False),
        sa.Column("host", sa.String(), nullable=True),
        sa.Column("state", sa.String(), nullable=False),
        sa.Column("attempt", sa.Integer(), nullable=False),
        sa.Column("deaths", sa.Integer(), nullable=False),
        sa.Column("worker", sa.String(), nullable=True),
        sa.Column("lease_s", sa.Double(), nullable=True),
        sa.Column("beat", sa.Integer(), nullable=False),
        sa.Column("stop_requested", sa.Boolean(), nullable=False),
        sa.Column("done", sa.Integer(), nullable=False),
        sa.Column("total", sa.Integer(), nullable=False),
        sa.Column("what", sa.Text(), nullable=False),
        sa.Column("error", sa.Text(), nullable=True),
        sa.Column("address", sa.String(), nullable=True),
        sa.Column("words", sa.Text(), nullable=True),
        sa.Column("result", sa.JSON(), nullable=True),
        sa.Column("asked_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("started_at", sa.DateTime(timezone=True), nullable=True),
        sa.Column("ended_at", sa.DateTime(timezone=True), nullable=True),
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("written_by_id", sa.Integer(), nullable=False),
        *(sa.CheckConstraint(rule, name=op.f(f"ck_jobs_{name}")) for name, rule in _RULES.items()),
        sa.ForeignKeyConstraint(
            ["written_by_id"], ["provenance.id"], name=op.f("fk_jobs_written_by_id_provenance")
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_jobs")),
    )
    with op.batch_alter_table("jobs", schema=None) as batch_op:
        batch_op.create_index("ix_jobs_state_id", ["state", "id"], unique=False)


def downgrade() -> None:
    with op.batch_alter_table("jobs", schema=None) as batch_op:
        batch_op.drop_index("ix_jobs_state_id")
    op.drop_table("jobs")
