"""The ball valve: what its port leaves open while the ball turns."""

from __future__ import annotations

import math

#: The ball turns this share of its quarter before its bore meets the seat.
DEAD_SHARE = 0.15


def valve_moments(opening_time_s: float) -> tuple[float, float]:
    """When (s) the port begins to open, and when it is open."""
    return DEAD_SHARE * opening_time_s, opening_time_s


def open_share(turned: float) -> float:
    """Open share of the port (0 to 1) when the ball has `turned` a share of its quarter.

    The bore's mouth slides across the seat, two equal circles whose distance falls evenly from their diameter to 0:
    what is open is the lens between them.
    """
    apart = 1 - (turned - DEAD_SHARE) / (1 - DEAD_SHARE)
    if apart >= 1:
        return 0.0
    if apart <= 0:
        return 1.0
    return 2 / math.pi * (math.acos(apart) - apart * math.sqrt(1 - apart**2))
