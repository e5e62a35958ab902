"""Displacement: how far an acceleration, integrated twice, carries the structure."""

from __future__ import annotations

import numpy as np

from ..channel import Channel
from .base import Contact, Finding
from .motion import motion_of

#: A body that keeps the largest velocity of the shock all the time gets this far, and a little
#: farther by the feet of a pulse, which lie below the 5 % of the peak that count as shock.
LIMIT = 1.1


def check_displacement(channel: Channel, contacts: tuple[Contact, ...]) -> list[Finding]:
    """At most one finding, of an acceleration that is not of what moves on purpose: its
    displacement passes (largest velocity of the shock) x (time since its begin).

    It sees slow baseline wander that comes back to zero velocity, which the velocity check does
    not. A `note` where an offset below 0.5 % of the peak would take it as far, else a `warning`.
    """
    motion = motion_of(channel, contacts)
    if motion is None:
        return []
    reach_m = motion.shock_velocity_m_s * motion.lasts_s
    farthest_m = float(np.abs(np.cumsum(motion.velocity_m_s)).max()) * motion.block_s
    if reach_m == 0.0 or farthest_m < LIMIT * reach_m + motion.drift_m_s2 * motion.lasts_s**2 / 2:
        return []
    evidence = {
        "displacement_m": farthest_m,
        "reach_m": reach_m,
        "displacement_ratio": farthest_m / reach_m,
        "limit_ratio": LIMIT,
    }
    message = (
        f"integrates to {farthest_m * 1e3:.3g} mm, where {motion.shock_velocity_m_s:.3g} m/s kept "
        f"to the end would give {reach_m * 1e3:.3g} mm: the baseline wanders; high-pass the "
        "record, or use only lines far above it"
    )
    return [
        Finding(
            "displacement",
            motion.severity(2.0 * farthest_m / motion.lasts_s**2),
            message,
            channel.name,
            evidence,
        )
    ]
