"""row hashes: every row with the SHA-256 of itself, in place of those of figures alone

The hash of rows that are there is of what they hold now. Where their figures had a hash, it is
compared before it goes: a row whose figures were altered is marked, and stays a finding of every
check. What else was altered, nobody can say.
"""

from __future__ import annotations

import hashlib
import json
import math
import sqlite3
from typing import Any

import sqlalchemy as sa
from alembic import op
from pyroshock.schema.access.roles import act_as_owner
from pyroshock.schema.base import from_plain
from pyroshock.schema.row_hashes import ALTERED
from pyroshock.schema.row_sealing import seal_table

revision = "0011"
down_revision = "0010"
branch_labels = None
depends_on = None

_PAGE = 500
_HIT = ("run", "repetition")
#: What was hashed, in this order.
_FIGURES = {
    "impacts": (*_HIT, "impact_velocity_m_s", "impact_velocity_u_m_s", "velocity_source"),
    "pulses": [
        "start_s",
        "contact_time_s",
        "compression_time_s",
        "peak_force_n",
        "spline_peak_force_n",
        "impulse_n_s",
        "compression_impulse_n_s",
        "width_half_s",
        "width_tenth_s",
        "samples_in_contact",
        "spline_nrmse",
        "segmentation_difference",
        "force_points_n",
        "fine_period_s",
        "fine_force_n",
    ],
    "channel_figures": [
        "largest",
        "rest_m_s2",
        "peak_acceleration_m_s2",
        "signed_peak_acceleration_m_s2",
        "peak_time_s",
        "pulse_start_s",
        "pulse_duration_s",
        "effective_duration_s",
        "energy_duration_s",
        "velocity_change_m_s",
        "record_velocity_change_m_s",
        "srs_frequency_hz",
        "srs_maximax_m_s2",
        "srs_peak_m_s2",
        "srs_peak_frequency_hz",
    ],
    "shots": (
        *_HIT,
        *[
            "tank_pressure_pa",
            "recorded_pressure_pa",
            "recorded_pressure_u_pa",
            "bullet_mass_kg",
            "bullet_length_m",
        ],
        *["measured_velocity_m_s", "measured_velocity_u_m_s", "velocity_source"],
    ),
}
_JSON = ("force_points_n", "srs_frequency_hz", "srs_maximax_m_s2")
_UNSEALED = sa.text("row_sha256 = 'unsealed'")


def upgrade() -> None:
    bind = op.get_bind()
    if bind.dialect.name == "postgresql":
        act_as_owner(bind)  # 0005 may have handed the tables over in this very transaction
    altered = {name: _altered(name) for name in _FIGURES}
    inspector = sa.inspect(bind)
    for name in _NAMES:
        key = inspector.get_pk_constraint(name)["constrained_columns"]
        op.add_column(name, sa.Column("row_sha256", sa.String(), nullable=True))
        op.create_index(
            f"ix_{name}_unsealed", name, key, sqlite_where=_UNSEALED, postgresql_where=_UNSEALED
        )
    for name in _FIGURES:
        _drop_column(name, "figures_sha256")
    if bind.scalar(sa.select(sa.func.count()).select_from(sa.table("provenance"))) == 0:
        return  # every row names who wrote it: there is none
    for table in _tables():
        seal_table(bind, table)
        if altered.get(table.name):
            mark = (
                sa.update(table)
                .where(table.c.id == sa.bindparam("altered"))
                .values(row_sha256=ALTERED)
            )
            bind.execute(mark, [{"altered": key} for key in altered[table.name]])


def downgrade() -> None:
    for name in _NAMES:
        op.drop_index(f"ix_{name}_unsealed", name)
        _drop_column(name, "row_sha256")
    for name in _FIGURES:
        op.add_column(name, sa.Column("figures_sha256", sa.String(), nullable=True))
        written = sa.update(_table(name)).where(sa.column("id") == sa.bindparam("key"))
        for page in _pages(name):
            hashes = [{"key": row.id, "figures_sha256": _hash(name, row)} for row in page]
            op.get_bind().execute(
                written.values(figures_sha256=sa.bindparam("figures_sha256")), hashes
            )


def _drop_column(table: str, column: str) -> None:
    """SQLite drops a column by itself since 3.35; before, the table is made anew."""
    if op.get_bind().dialect.name == "sqlite" and sqlite3.sqlite_version_info >= (3, 35):
        op.execute(f"ALTER TABLE {table} DROP COLUMN {column}")
        return
    with op.batch_alter_table(table, schema=None) as batch_op:
        batch_op.drop_column(column)


def _tables() -> list[sa.Table]:
    """As they are in the store."""
    metadata = sa.MetaData()
    metadata.reflect(op.get_bind(), only=_NAMES)
    return metadata.sorted_tables


#: A database may hold tables of others.
_NAMES = (
    "campaigns",
    "channel_figures",
    "channels",
    "configuration_levels",
    "configurations",
    "dataset_snapshots",
    "diagnoses",
    "extraction_settings",
    "factor_levels",
    "factors",
    "guns",
    "hammers",
    "impacts",
    "jobs",
    "material_aliases",
    "materials",
    "modal_tables",
    "mode_shapes",
    "modes",
    "planned_runs",
    "plans",
    "plates",
    "provenance",
    "pulses",
    "quality_findings",
    "recordings",
    "series_chunks",
    "shots",
    "snapshot_pulses",
    "tombstones",
    "twin_configurations",
)


def _altered(name: str) -> list[int]:
    """Keys of the rows whose figures are not those of their hash. One without a hash is older than
    these."""
    return [
        row.id
        for page in _pages(name)
        for row in page
        if row.figures_sha256 not in (None, _hash(name, row))
    ]


def _table(name: str) -> Any:
    return sa.table(
        name,
        sa.column("id"),
        sa.column("figures_sha256"),
        *(sa.column(own) for own in _FIGURES[name]),
    )


def _pages(name: str) -> Any:
    table, after = _table(name), 0
    own = [
        sa.cast(column, sa.Text).label(column.name) if column.name in _JSON else column
        for column in table.c
    ]
    query = sa.select(*own).order_by(table.c.id).limit(_PAGE)
    while page := op.get_bind().execute(query.where(table.c.id > after)).all():
        yield page
        after = page[-1].id


def _hash(name: str, row: Any) -> str:
    lines = (
        f"{column}={_exact(_decoded(column, getattr(row, column)))}" for column in _FIGURES[name]
    )
    return hashlib.sha256("\n".join(lines).encode()).hexdigest()


def _decoded(column: str, value: Any) -> Any:
    try:
        return from_plain(json.loads(value)) if column in _JSON else value
    except (TypeError, ValueError):
        return value


def _exact(value: Any) -> str:
    if value is None or isinstance(value, str):
        return repr(value)
    if isinstance(value, bytes | bytearray | memoryview):
        return hashlib.sha256(value).hexdigest()
    if isinstance(value, list):
        return f"[{','.join(map(_exact, value))}]"
    number = float(value)
    return "None" if math.isnan(number) else (number + 0.0).hex()
