"""photographs and documents are attached to campaigns, runs, impacts and plans"""

from __future__ import annotations

from typing import Any

import sqlalchemy as sa
from alembic import op

revision = "0019"
down_revision = "0018"
branch_labels = None
depends_on = None

_KINDS = "('user', 'token', 'local', 'system')"
_SUBJECTS = "subject_kind IN ('campaign', 'run', 'impact', 'plan')"
_SUBJECT = ("subject_kind", "subject", "run", "repetition")
_OFFICE = "application/vnd.openxmlformats-officedocument"
_OPEN = "application/vnd.oasis.opendocument"
_MEDIA_TYPES = (
    *("image/jpeg", "image/png", "image/gif", "image/webp"),
    *("application/pdf", "text/plain", "application/zip"),
    f"{_OFFICE}.wordprocessingml.document",
    f"{_OFFICE}.spreadsheetml.sheet",
    f"{_OFFICE}.presentationml.presentation",
    *(f"{_OPEN}.text", f"{_OPEN}.spreadsheet", f"{_OPEN}.presentation"),
)


def upgrade() -> None:
    _table(
        "attached_contents",
        _key(),
        sa.Column("sha256", sa.String(), nullable=False),
        sa.Column("size_bytes", sa.Integer(), nullable=False),
        sa.Column("media_type", sa.String(), nullable=False),
        sa.Column("width_px", sa.Integer()),
        sa.Column("height_px", sa.Integer()),
        sa.PrimaryKeyConstraint("id", name="pk_attached_contents"),
        sa.UniqueConstraint("sha256", name="uq_attached_contents_sha256"),
        _check("attached_contents", "sha256_length", "length(sha256) = 64"),
        _check("attached_contents", "size_positive", "size_bytes > 0"),
        _check(
            "attached_contents",
            "media_type_known",
            f"media_type IN ({', '.join(map(repr, _MEDIA_TYPES))})",
        ),
        _check("attached_contents", "both_sides", "(width_px IS NULL) = (height_px IS NULL)"),
        keys=("id",),
    )
    _table(
        "attached_pieces",
        sa.Column("content_id", sa.Integer(), nullable=False),
        sa.Column("number", sa.Integer(), nullable=False),
        sa.Column("data", sa.LargeBinary(), nullable=False),
        sa.PrimaryKeyConstraint("content_id", "number", name="pk_attached_pieces"),
        _reference("attached_pieces", "content_id", "attached_contents"),
        keys=("content_id", "number"),
    )
    _attachments()
    connection = op.get_bind()
    if connection.dialect.name == "postgresql":
        from pyroshock.schema.access.permissions import missing_roles
        from pyroshock.schema.access.roles import grant_rights

        # Without CREATEROLE there are no roles: `pyroshock db roles` makes them, and grants.
        if not missing_roles(connection):
            grant_rights(connection)


def _attachments() -> None:
    name = "attachments"
    removed = ("removed_by", "removed_by_kind", "removal_reason")
    _table(
        name,
        _key(),
        *(sa.Column(column, sa.String(), nullable=False) for column in _SUBJECT[:2]),
        *(sa.Column(column, sa.Integer(), nullable=False) for column in _SUBJECT[2:]),
        *(sa.Column(column, sa.String(), nullable=False) for column in ("author", "author_kind")),
        sa.Column("content_id", sa.Integer(), nullable=False),
        sa.Column("file_name", sa.String(), nullable=False),
        sa.Column("caption", sa.Text()),
        sa.Column("attached_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("removed_at", sa.DateTime(timezone=True)),
        sa.Column("removed_by", sa.String()),
        sa.Column("removed_by_kind", sa.String()),
        sa.Column("removal_reason", sa.Text()),
        sa.PrimaryKeyConstraint("id", name=f"pk_{name}"),
        _reference(name, "content_id", "attached_contents"),
        _check(name, "subject_kind_known", _SUBJECTS),
        _check(name, "author_kind_known", f"author_kind IN {_KINDS}"),
        _check(
            name,
            "removed_by_kind_known",
            f"removed_by_kind IS NULL OR removed_by_kind IN {_KINDS}",
        ),
        _check(name, "file_name_length", "length(file_name) BETWEEN 1 AND 200"),
        *(
            _check(name, f"removed_with_{column}", f"(removed_at IS NULL) = ({column} IS NULL)")
            for column in removed
        ),
        sa.UniqueConstraint(
            *_SUBJECT,
            "content_id",
            "attached_at",
            name=f"uq_{name}_subject_content_moment",
        ),
        keys=("id",),
    )
    op.create_index(f"ix_{name}_content_id", name, ["content_id"])


def _table(name: str, *parts: sa.schema.SchemaItem, keys: tuple[str, ...]) -> None:
    """A table with its writer, its hash, and the index of the rows that a transaction has still to
    seal."""
    op.create_table(
        name,
        *parts,
        sa.Column("written_by_id", sa.Integer(), nullable=False),
        sa.Column("row_sha256", sa.String()),
        _reference(name, "written_by_id", "provenance"),
    )
    unsealed: dict[str, Any] = dict.fromkeys(
        ("sqlite_where", "postgresql_where"), sa.text("row_sha256 = 'unsealed'")
    )
    op.create_index(f"ix_{name}_unsealed", name, list(keys), **unsealed)


def _key() -> sa.Column[Any]:
    return sa.Column("id", sa.Integer(), autoincrement=True, nullable=False)


def _check(table: str, name: str, condition: str) -> sa.CheckConstraint:
    return sa.CheckConstraint(condition, name=op.f(f"ck_{table}_{name}"))


def _reference(table: str, column: str, target: str) -> sa.ForeignKeyConstraint:
    return sa.ForeignKeyConstraint([column], [f"{target}.id"], name=f"fk_{table}_{column}_{target}")
