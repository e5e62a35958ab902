"""A row's figures under a SHA-256, so that a number that was altered in the store is noticed.

The hash is made when the row is written, of the columns named here, and `care.checks.figures` makes it again. Numbers
are hashed by all of their bits; what one of the engines does not keep (the sign of zero, and NaN, which SQLite takes
for NULL) does not count.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Mapping
from typing import Any

IMPACT = ("run", "repetition", "impact_velocity_m_s", "impact_velocity_u_m_s", "velocity_source")
PULSE = (
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
CHANNEL = (
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
)
SHOT = (
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


def figures_hash(row: Mapping[str, Any], columns: tuple[str, ...]) -> str:
    """SHA-256 of these columns of a row; one that it lacks is NULL."""
    lines = (f"{name}={_exact(row.get(name))}" for name in columns)
    return hashlib.sha256("\n".join(lines).encode()).hexdigest()


def hashed(columns: tuple[str, ...]) -> Callable[[Any], str]:
    """The default of a column that holds the hash: SQLAlchemy gives it the statement with the row that is written."""
    return lambda context: figures_hash(context.get_current_parameters(), columns)


def _exact(value: Any) -> str:
    if value is None or isinstance(value, str):
        return repr(value)
    if isinstance(value, bytes | bytearray | memoryview):
        return hashlib.sha256(value).hexdigest()
    if isinstance(value, list | tuple):
        return f"[{','.join(map(_exact, value))}]"
    try:
        number = float(value)
    except (TypeError, ValueError):  # in a damaged store
        return repr(value)
    return "None" if math.isnan(number) else (number + 0.0).hex()
