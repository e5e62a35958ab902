"""The ball valve: what its port leaves open while the ball turns."""

from __future__ import annotations

import math

#: The ball turns this share of its quarter before its bore meets the seat.
DEAD_SHARE = 0.15
#: Largest over smallest flow that the characteristic covers: ball valves are made with 30 to 300.
RANGEABILITY = 50.0


def valve_moments(opening_time_s: float) -> tuple[float, float]:
    """When (s) the port begins to open, and when it is open."""
    return DEAD_SHARE * opening_time_s, opening_time_s


def open_share(turned: float) -> float:
    """Open share of the port (0 to 1) when the ball has `turned` a share of its quarter.

    The inherent flow characteristic of a ball valve is close to equal percentage (IEC 60534-2-4:2009): equal steps of
    the travel h multiply the flow by equal factors, R^(h - 1). That law leaves 1 / R at h = 0, where a ball valve is
    shut; with this share taken off, it is (R^h - 1) / (R - 1).
    """
    travel = (turned - DEAD_SHARE) / (1 - DEAD_SHARE)
    if travel <= 0:
        return 0.0
    if travel >= 1:
        return 1.0
    return math.expm1(travel * math.log(RANGEABILITY)) / (RANGEABILITY - 1)
