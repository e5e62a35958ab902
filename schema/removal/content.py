"""Figures of hits under a SHA-256 without keys, clocks and writers: by it the same content is known
again, in another store and after it was deleted.

Tombstones keep what is made of these hashes: the columns and their order stay as they are.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping
from typing import Any

from sqlalchemy import Select, select
from sqlalchemy.orm import Session

from ..impacts import Impact, Pulse, Shot
from ..series import in_closest_packing

_IMPACT = ("run", "repetition", "impact_velocity_m_s", "impact_velocity_u_m_s", "velocity_source")
_PULSE = (
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
)
_SHOT = (
    "run",
    "repetition",
    "tank_pressure_pa",
    "recorded_pressure_pa",
    "recorded_pressure_u_pa",
    "bullet_mass_kg",
    "bullet_length_m",
    "measured_velocity_m_s",
    "measured_velocity_u_m_s",
    "velocity_source",
)
_OF: dict[type[Impact] | type[Pulse] | type[Shot], tuple[str, ...]] = {
    Impact: _IMPACT,
    Pulse: _PULSE,
    Shot: _SHOT,
}
_PAGE = 500


def figures_hashes(
    session: Session, model: type[Impact] | type[Pulse] | type[Shot], keys: Select[Any]
) -> dict[int, str]:
    """SHA-256 of the figures of the rows whose key `keys` selects, by their key."""
    columns = _OF[model]
    query = select(model.id, *(getattr(model, name) for name in columns)).where(model.id.in_(keys))
    result = session.execute(query, execution_options={"yield_per": _PAGE})
    return {row["id"]: _figures_hash(dict(row), columns) for row in result.mappings()}


def _figures_hash(row: Mapping[str, Any], columns: tuple[str, ...]) -> str:
    lines = (f"{name}={_exact(row[name])}" for name in columns)
    return hashlib.sha256("\n".join(lines).encode()).hexdigest()


def _exact(value: Any) -> str:
    if value is None or isinstance(value, str):
        return repr(value)
    if isinstance(value, bytes | bytearray | memoryview):
        return hashlib.sha256(in_closest_packing(bytes(value))).hexdigest()
    if isinstance(value, list):
        return f"[{','.join(map(_exact, value))}]"
    number = float(value)
    return "None" if math.isnan(number) else (number + 0.0).hex()
