"""people with roles, the audit trail, notes, tags and saved filters

A job knows who has asked for it; of those that were there before, nobody is known.
"""

from __future__ import annotations

from typing import Any

import sqlalchemy as sa
from alembic import op

revision = "0015"
down_revision = "0014"
branch_labels = None
depends_on = None

_ROLES = "role IN ('reader', 'operator', 'engineer', 'administrator')"
_KINDS = "('user', 'token', 'local', 'system')"
_SUBJECTS = "subject_kind IN ('campaign', 'run', 'impact', 'model')"
_SUBJECT = ("subject_kind", "subject", "run", "repetition")


def upgrade() -> None:
    op.add_column("jobs", sa.Column("asked_by", sa.String()))
    op.add_column("jobs", sa.Column("asked_by_kind", sa.String()))
    _people()
    _audit_trail()
    _notes()
    connection = op.get_bind()
    if connection.dialect.name == "postgresql":
        from pyroshock.schema.access.permissions import missing_roles
        from pyroshock.schema.access.roles import grant_rights

        # Without CREATEROLE there are no roles: `pyroshock db roles` makes them, and grants.
        if not missing_roles(connection):
            grant_rights(connection)


def _people() -> None:
    _table(
        "users",
        sa.Column("name", sa.String(), nullable=False),
        sa.Column("role", sa.String(), nullable=False),
        _time("made_at"),
        sa.Column("removed_at", sa.DateTime(timezone=True)),
        sa.Column("generation", sa.Integer(), nullable=False),
        sa.UniqueConstraint("name", name="uq_users_name"),
        _check("users", "role_known", _ROLES),
        _check("users", "name_length", "length(name) BETWEEN 1 AND 64"),
        _check("users", "generation_positive", "generation >= 1"),
    )
    _table(
        "password_hashes",
        sa.Column("user_id", sa.Integer(), nullable=False),
        sa.Column("argon2", sa.String(), nullable=False),
        _time("changed_at"),
        _reference("password_hashes", "user_id", "users"),
        sa.UniqueConstraint("user_id", name="uq_password_hashes_user_id"),
    )
    _table(
        "personal_tokens",
        sa.Column("user_id", sa.Integer(), nullable=False),
        sa.Column("label", sa.String(), nullable=False),
        sa.Column("role", sa.String(), nullable=False),
        sa.Column("sha256", sa.String(), nullable=False),
        _time("made_at"),
        sa.Column("revoked_at", sa.DateTime(timezone=True)),
        _reference("personal_tokens", "user_id", "users"),
        sa.UniqueConstraint("sha256", name="uq_personal_tokens_sha256"),
        _check("personal_tokens", "role_known", _ROLES),
        _check("personal_tokens", "sha256_length", "length(sha256) = 64"),
    )
    op.create_index("ix_personal_tokens_user_id", "personal_tokens", ["user_id"])


def _audit_trail() -> None:
    _table(
        "audit_rows",
        _time("happened_at"),
        sa.Column("person", sa.String(), nullable=False),
        sa.Column("person_kind", sa.String(), nullable=False),
        sa.Column("operation", sa.String(), nullable=False),
        sa.Column("subject", sa.String(), nullable=False),
        sa.Column("request", sa.JSON(), nullable=False),
        sa.Column("outcome", sa.String(), nullable=False),
        sa.Column("message", sa.Text()),
        sa.Column("job", sa.Integer()),
        _check("audit_rows", "person_kind_known", f"person_kind IN {_KINDS}"),
        _check("audit_rows", "outcome_known", "outcome IN ('done', 'asked', 'failed', 'stopped')"),
    )
    op.create_index("ix_audit_rows_person_id", "audit_rows", ["person", "id"])
    op.create_index("ix_audit_rows_operation_id", "audit_rows", ["operation", "id"])


def _notes() -> None:
    _table(
        "notes",
        sa.Column("first_id", sa.Integer()),
        sa.Column("text", sa.Text()),
        sa.Column("reason", sa.Text()),
        _time("written_at"),
        *_about("notes"),
        _reference("notes", "first_id", "notes"),
        _check("notes", "text_or_reason", "(text IS NULL) = (reason IS NOT NULL)"),
        _check("notes", "withdrawn_is_later", "reason IS NULL OR first_id IS NOT NULL"),
    )
    op.create_index("ix_notes_subject", "notes", [*_SUBJECT])
    op.create_index("ix_notes_first_id", "notes", ["first_id"])
    _table(
        "tags",
        sa.Column("word", sa.String(), nullable=False),
        _time("tagged_at"),
        *_about("tags"),
        _check("tags", "word_length", "length(word) BETWEEN 1 AND 40"),
        sa.UniqueConstraint(*_SUBJECT, "word", name=f"uq_tags_{'_'.join(_SUBJECT)}_word"),
    )
    op.create_index("ix_tags_subject_kind_word", "tags", ["subject_kind", "word"])
    _table(
        "saved_filters",
        sa.Column("name", sa.String(), nullable=False),
        sa.Column("page", sa.String(), nullable=False),
        sa.Column("filter", sa.Text(), nullable=False),
        _time("saved_at"),
        *_by_person("saved_filters"),
        sa.UniqueConstraint("name", name="uq_saved_filters_name"),
    )


def _about(table: str) -> list[sa.schema.SchemaItem]:
    return [
        sa.Column("subject_kind", sa.String(), nullable=False),
        sa.Column("subject", sa.String(), nullable=False),
        sa.Column("run", sa.Integer(), nullable=False),
        sa.Column("repetition", sa.Integer(), nullable=False),
        _check(table, "subject_kind_known", _SUBJECTS),
        *_by_person(table),
    ]


def _by_person(table: str) -> list[sa.schema.SchemaItem]:
    return [
        sa.Column("author", sa.String(), nullable=False),
        sa.Column("author_kind", sa.String(), nullable=False),
        _check(table, "author_kind_known", f"author_kind IN {_KINDS}"),
    ]


def _table(name: str, *parts: sa.schema.SchemaItem) -> None:
    """A table with its key, its writer, its hash, and the index of the rows that a transaction has
    still to seal."""
    op.create_table(
        name,
        *parts,
        sa.Column("id", sa.Integer(), autoincrement=True, nullable=False),
        sa.Column("written_by_id", sa.Integer(), nullable=False),
        sa.Column("row_sha256", sa.String()),
        sa.PrimaryKeyConstraint("id", name=f"pk_{name}"),
        _reference(name, "written_by_id", "provenance"),
    )
    unsealed: dict[str, Any] = dict.fromkeys(
        ("sqlite_where", "postgresql_where"), sa.text("row_sha256 = 'unsealed'")
    )
    op.create_index(f"ix_{name}_unsealed", name, ["id"], **unsealed)


def _time(name: str) -> sa.Column[Any]:
    return sa.Column(name, sa.DateTime(timezone=True), nullable=False)


def _check(table: str, name: str, condition: str) -> sa.CheckConstraint:
    return sa.CheckConstraint(condition, name=op.f(f"ck_{table}_{name}"))


def _reference(table: str, column: str, target: str) -> sa.ForeignKeyConstraint:
    return sa.ForeignKeyConstraint([column], [f"{target}.id"], name=f"fk_{table}_{column}_{target}")
