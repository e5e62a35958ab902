"""hashed figures: impacts, pulses and shots with the SHA-256 of their figures

The hash of rows that are there is of what they hold now: whether that was ever altered, nobody can
say.
"""

from __future__ import annotations

import hashlib
import math
from typing import Any

import sqlalchemy as sa
from alembic import op

revision = "0007"
down_revision = "0006"
branch_labels = None
depends_on = None

_PAGE = 500
_HIT = ("run", "repetition")
_PULSE = (
    "start_s contact_time_s compression_time_s peak_force_n spline_peak_force_n impulse_n_s "
    "compression_impulse_n_s width_half_s width_tenth_s samples_in_contact spline_nrmse "
    "segmentation_difference force_points_n fine_period_s fine_force_n"
)
_SHOT = (
    "tank_pressure_pa recorded_pressure_pa recorded_pressure_u_pa bullet_mass_kg bullet_length_m "
    "measured_velocity_m_s measured_velocity_u_m_s velocity_source"
)
#: What is hashed, in this order.
_FIGURES = {
    "impacts": (*_HIT, "impact_velocity_m_s", "impact_velocity_u_m_s", "velocity_source"),
    "pulses": tuple(_PULSE.split()),
    "shots": (*_HIT, *_SHOT.split()),
}
_TYPES: dict[str, Any] = {
    "force_points_n": sa.JSON,
    "fine_force_n": sa.LargeBinary,
    "velocity_source": sa.String,
}
_INTEGERS = ("run", "repetition", "samples_in_contact")


def upgrade() -> None:
    for name, columns in _FIGURES.items():
        with op.batch_alter_table(name, schema=None) as batch_op:
            batch_op.add_column(sa.Column("figures_sha256", sa.String(), nullable=True))
        _fill(name, columns)


def downgrade() -> None:
    for name in _FIGURES:
        with op.batch_alter_table(name, schema=None) as batch_op:
            batch_op.drop_column("figures_sha256")


def _fill(name: str, columns: tuple[str, ...]) -> None:
    connection, after = op.get_bind(), 0
    own = [
        sa.column(column, _TYPES.get(column, sa.Integer if column in _INTEGERS else sa.Float))
        for column in columns
    ]
    table = sa.table(
        name, sa.column("id", sa.Integer), sa.column("figures_sha256", sa.String), *own
    )
    query = sa.select(table.c.id, *own).order_by(table.c.id).limit(_PAGE)
    write = sa.update(table).where(table.c.id == sa.bindparam("key"))
    while page := connection.execute(query.where(table.c.id > after)).all():
        connection.execute(
            write, [{"key": key, "figures_sha256": _hash(columns, row)} for key, *row in page]
        )
        after = page[-1].id


def _hash(columns: tuple[str, ...], row: list[Any]) -> str:
    lines = (f"{name}={_exact(value)}" for name, value in zip(columns, row, strict=True))
    return hashlib.sha256("\n".join(lines).encode()).hexdigest()


def _exact(value: Any) -> str:
    if value is None or isinstance(value, str):
        return repr(value)
    if isinstance(value, bytes | memoryview):
        return hashlib.sha256(value).hexdigest()
    if isinstance(value, list):
        return f"[{','.join(map(_exact, value))}]"
    if isinstance(value, dict):  # a number that JSON has not: {"$float": "nan"}
        value = next(iter(value.values()), "nan")
    number = float(value)
    return "None" if math.isnan(number) else (number + 0.0).hex()
