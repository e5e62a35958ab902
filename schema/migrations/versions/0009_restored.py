"""restored: what was deleted may come back, or be replaced, and tombstones say so"""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op
from pyroshock.schema.access.roles import act_as_owner

revision = "0009"
down_revision = "0008"
branch_labels = None
depends_on = None

_TEXTS = ("file_sha256", "replaced_by", "archive_path", "archive_sha256")
_RULES = {
    "file_sha256_of_recording": "file_sha256 IS NULL OR (length(file_sha256) = 64 AND kind = "
    "'recording')",
    "replaced_by_of_recording": "replaced_by IS NULL OR (length(replaced_by) = 64 AND kind = "
    "'recording')",
    "archive_of_campaign": "archive_sha256 IS NULL OR "
    "(length(archive_sha256) = 64 AND kind = 'campaign')",
    "archive_with_sha256": "(archive_path IS NULL) = (archive_sha256 IS NULL)",
}


def upgrade() -> None:
    if op.get_bind().dialect.name == "postgresql":
        act_as_owner(op.get_bind())
    with op.batch_alter_table("tombstones", schema=None) as batch_op:
        for name in _TEXTS:
            batch_op.add_column(sa.Column(name, sa.String(), nullable=True))
        batch_op.add_column(sa.Column("restored_at", sa.DateTime(timezone=True), nullable=True))
        for name, rule in _RULES.items():
            batch_op.create_check_constraint(op.f(f"ck_tombstones_{name}"), rule)


def downgrade() -> None:
    """What came back is no longer told."""
    with op.batch_alter_table("tombstones", schema=None) as batch_op:
        for name in _RULES:
            batch_op.drop_constraint(op.f(f"ck_tombstones_{name}"), type_="check")
        for name in (*_TEXTS, "restored_at"):
            batch_op.drop_column(name)
