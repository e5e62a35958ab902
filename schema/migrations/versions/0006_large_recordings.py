"""large recordings: a file's size may be more than 2 GB"""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0006"
down_revision = "0005"
branch_labels = None
depends_on = None


def upgrade() -> None:
    _size(sa.BigInteger())


def downgrade() -> None:
    """PostgreSQL refuses it where such a recording is there."""
    _size(sa.Integer())


def _size(kind: sa.types.TypeEngine[int]) -> None:
    if op.get_bind().dialect.name == "postgresql":  # SQLite's integers have 64 bits
        op.alter_column("recordings", "size_bytes", type_=kind)
