"""append-only records: operators add recordings, calibrations and samples, and change or delete
none; and the list of registered versions of models, so that a registry that is lost is told

On PostgreSQL, three functions do what the software itself must change as an operator, each within
what it checks: they run with their owner's rights, name every object by its schema, and look up
nothing else but in pg_catalog.
"""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0012"
down_revision = "0011"
branch_labels = None
depends_on = None

_FUNCTIONS = (
    """
CREATE FUNCTION {schema}.pyroshock_delete_set_aside(recording integer) RETURNS integer
LANGUAGE sql SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
  WITH gone AS (
    DELETE FROM {schema}.recordings r WHERE r.id = $1 AND r.status = 'set aside'
    AND NOT EXISTS (SELECT FROM {schema}.channels c WHERE c.recording_id = r.id)
    RETURNING 1
  ) SELECT pg_catalog.count(*)::integer FROM gone
$$""",
    """
CREATE FUNCTION {schema}.pyroshock_replace_set_aside(
  recording integer, new_sha256 text, new_size bigint, new_format text, new_status text,
  new_reason text, new_writer integer, new_row_sha256 text
) RETURNS integer
LANGUAGE sql SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
  WITH changed AS (
    UPDATE {schema}.recordings r SET sha256 = $2, size_bytes = $3, format = $4, status = $5,
      reason = $6, written_by_id = $7, row_sha256 = $8
    WHERE r.id = $1 AND r.status = 'set aside'
    AND NOT EXISTS (SELECT FROM {schema}.channels c WHERE c.recording_id = r.id)
    RETURNING 1
  ) SELECT pg_catalog.count(*)::integer FROM changed
$$""",
    # A whole chunk is known by its row's SHA-256, in the form of schema/row_hashes.py.
    """
CREATE FUNCTION {schema}.pyroshock_delete_damaged_chunks(channel integer) RETURNS integer
LANGUAGE sql SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
  WITH gone AS (
    DELETE FROM {schema}.series_chunks s USING {schema}.channels c
    WHERE s.channel_id = $1 AND c.id = $1 AND (
      s.number < 0 OR s.number::bigint * c.chunk_samples >= c.samples
      OR s.row_sha256 IS DISTINCT FROM pg_catalog.encode(pg_catalog.sha256(pg_catalog.convert_to(
        'channel_id=integer ' || s.channel_id
        || E'\\nframe=bytes ' || pg_catalog.encode(pg_catalog.sha256(s.frame), 'hex')
        || E'\\nnumber=integer ' || s.number
        || COALESCE(E'\\nwritten_by_id=integer ' || s.written_by_id, ''), 'UTF8')), 'hex')
    )
    RETURNING 1
  ) SELECT pg_catalog.count(*)::integer FROM gone
$$""",
    """
CREATE FUNCTION {schema}.pyroshock_withdraw_force_sign(recording integer) RETURNS integer
LANGUAGE sql SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
  WITH gone AS (
    DELETE FROM {schema}.quality_findings f WHERE f.recording_id = $1 AND f."check" = 'force-sign'
    RETURNING 1
  ) SELECT pg_catalog.count(*)::integer FROM gone
$$""",
)
_SIGNATURES = (
    "pyroshock_delete_set_aside(integer)",
    "pyroshock_replace_set_aside(integer, text, bigint, text, text, text, integer, text)",
    "pyroshock_delete_damaged_chunks(integer)",
    "pyroshock_withdraw_force_sign(integer)",
)
#: What an operator might change before.
_CHANGED = (
    "recordings",
    "channels",
    "series_chunks",
    "quality_findings",
    "impacts",
    "shots",
    "pulses",
    "campaigns",
)
_DELETED_FROM = ("recordings", "series_chunks")


_TABLE = "registered_versions"
_UNSEALED = sa.text("row_sha256 = 'unsealed'")


def upgrade() -> None:
    connection = op.get_bind()
    if connection.dialect.name != "postgresql":
        _create_table()
        return
    from pyroshock.schema.access.permissions import missing_roles
    from pyroshock.schema.access.roles import act_as_owner, grant_rights, names_in, run

    act_as_owner(connection)
    _create_table()
    names = names_in(connection)
    for function in _FUNCTIONS:
        run(connection, function, names)
    for signature in _SIGNATURES:
        run(connection, f"REVOKE ALL ON FUNCTION {{schema}}.{signature} FROM PUBLIC", names)
    if not missing_roles(connection):
        grant_rights(connection)


def _create_table() -> None:
    op.create_table(
        _TABLE,
        sa.Column("label", sa.String(), nullable=False),
        sa.Column("name", sa.String(), nullable=False),
        sa.Column("version", sa.Integer(), nullable=False),
        sa.Column("dataset", sa.String(), nullable=False),
        sa.Column("dataset_hash", sa.String(), nullable=False),
        sa.Column("sha256", sa.String(), nullable=False),
        sa.Column("registry_address", sa.String(), nullable=False),
        sa.Column("registered_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("record", sa.JSON(), nullable=False),
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("written_by_id", sa.Integer(), nullable=False),
        sa.Column("row_sha256", sa.String(), nullable=True),
        sa.CheckConstraint("version > 0", name=op.f("ck_registered_versions_version_positive")),
        sa.CheckConstraint(
            "length(sha256) = 64", name=op.f("ck_registered_versions_sha256_length")
        ),
        sa.CheckConstraint(
            "length(dataset_hash) = 64", name=op.f("ck_registered_versions_dataset_hash_length")
        ),
        sa.ForeignKeyConstraint(
            ["written_by_id"],
            ["provenance.id"],
            name=op.f("fk_registered_versions_written_by_id_provenance"),
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_registered_versions")),
        sa.UniqueConstraint("label", "sha256", name=op.f("uq_registered_versions_label_sha256")),
    )
    op.create_index("ix_registered_versions_dataset_hash", _TABLE, ["dataset_hash"])
    op.create_index(
        "ix_registered_versions_unsealed",
        _TABLE,
        ["id"],
        sqlite_where=_UNSEALED,
        postgresql_where=_UNSEALED,
    )


def downgrade() -> None:
    connection = op.get_bind()
    op.drop_table(_TABLE)
    if connection.dialect.name != "postgresql":
        return
    from pyroshock.schema.access.permissions import missing_roles
    from pyroshock.schema.access.roles import act_as_owner, names_in, run

    act_as_owner(connection)
    names = names_in(connection)
    for signature in _SIGNATURES:
        run(connection, f"DROP FUNCTION {{schema}}.{signature}", names)
    if not missing_roles(connection):
        for table in _CHANGED:
            run(connection, f"GRANT UPDATE ON TABLE {table} TO {{operator}}", names)
        for table in _DELETED_FROM:
            run(connection, f"GRANT DELETE ON TABLE {table} TO {{operator}}", names)
