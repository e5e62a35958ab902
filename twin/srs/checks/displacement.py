"""Displacement: how far the record, integrated twice, carries the structure."""

from __future__ import annotations

import numpy as np

from ....signals.srs.record import Spectrum
from .base import Finding, Record

#: A body that keeps the largest velocity of the shock all the time gets this far and no farther.
LIMIT = 1.0


def check_displacement(record: Record, _: Spectrum) -> Finding | None:
    """Largest displacement in shares of (largest velocity of the shock) x (time since its begin). It sees slow baseline
    wander that comes back to zero velocity, which the velocity check does not."""
    first = record.shock[0]
    velocity = record.velocity[first:] - record.velocity[first]
    lasts = velocity.size / record.sampling_rate_hz
    reach = record.shock_velocity_m_s * lasts
    if reach == 0.0:
        return None
    farthest = float(np.abs(np.cumsum(velocity)).max()) / record.sampling_rate_hz
    if farthest < max(LIMIT * reach, record.drift_m_s2 * lasts**2 / 2):
        return None
    message = (
        f"integrates to {farthest * 1e3:.3g} mm, where {record.shock_velocity_m_s:.3g} m/s kept to the end would give "
        f"{reach * 1e3:.3g} mm: the baseline wanders; high-pass the record, or use only lines far above the wander"
    )
    return Finding("displacement", farthest / reach, LIMIT, "", message)
