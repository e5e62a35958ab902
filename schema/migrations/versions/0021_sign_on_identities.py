"""accounts at an identity provider, and which users they are"""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0021"
down_revision = "0020"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.create_table(
        "sign_on_identities",
        sa.Column("id", sa.Integer(), autoincrement=True, nullable=False),
        sa.Column("user_id", sa.Integer(), nullable=False),
        sa.Column("login", sa.String(), nullable=False),
        sa.Column("issuer", sa.String()),
        sa.Column("subject", sa.String()),
        sa.Column("by_group", sa.Boolean(), nullable=False),
        sa.Column("invited_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("bound_at", sa.DateTime(timezone=True)),
        sa.Column("written_by_id", sa.Integer(), nullable=False),
        sa.Column("row_sha256", sa.String()),
        sa.PrimaryKeyConstraint("id", name="pk_sign_on_identities"),
        sa.ForeignKeyConstraint(
            ["user_id"], ["users.id"], name="fk_sign_on_identities_user_id_users"
        ),
        sa.ForeignKeyConstraint(
            ["written_by_id"],
            ["provenance.id"],
            name="fk_sign_on_identities_written_by_id_provenance",
        ),
        sa.UniqueConstraint("user_id", name="uq_sign_on_identities_user_id"),
        sa.UniqueConstraint("login", name="uq_sign_on_identities_login"),
        sa.UniqueConstraint("issuer", "subject", name="uq_sign_on_identities_issuer_subject"),
        sa.CheckConstraint(
            "(issuer IS NULL) = (subject IS NULL)",
            name=op.f("ck_sign_on_identities_issuer_with_subject"),
        ),
        sa.CheckConstraint(
            "(subject IS NULL) = (bound_at IS NULL)",
            name=op.f("ck_sign_on_identities_bound_with_subject"),
        ),
    )
    unsealed = sa.text("row_sha256 = 'unsealed'")
    op.create_index(
        "ix_sign_on_identities_unsealed",
        "sign_on_identities",
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
