"""Velocity: does the integral of the record end where a structure can be?"""

from __future__ import annotations

from ....signals.srs.record import Spectrum
from .base import Finding, Record

#: A free body keeps at most the largest velocity that the shock gave it; half as much again is for noise.
LIMIT = 1.5


def check_velocity(record: Record, _: Spectrum) -> Finding | None:
    """Final velocity in shares of the largest while the shock lasts. After A. G. Piersol's check of pyroshock data
    (NASA-HDBK-7005, section 4; IEST-RP-DTE012): velocity comes back to rest, or levels out on a free body."""
    if record.shock_velocity_m_s == 0.0:
        return None
    final = float(record.velocity[-1] - record.velocity[record.shock[0]])
    value = abs(final) / record.shock_velocity_m_s
    by_noise = record.drift_m_s2 * (record.acceleration.size - record.shock[0]) / record.sampling_rate_hz
    if value < LIMIT or abs(final) < by_noise:
        return None
    message = (
        f"integrates to {final:.3g} m/s at the end, after {record.shock_velocity_m_s:.3g} m/s in the shock: an offset, "
        "unless something pushed on; do not trust lines at which the pseudo-velocity is of that size"
    )
    return Finding("velocity", value, LIMIT, "", message)
