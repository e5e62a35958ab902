"""Flow of a gas through an opening, as ISO 6358 writes it, by its area of flow.

mdot = A c* p1 / sqrt(R T1) phi(p2 / p1), c* = sqrt(gamma) (2 / (gamma + 1))^((gamma + 1) / (2 gamma - 2)),
phi(r) = 1 up to the critical ratio b, sqrt(1 - ((r - b) / (1 - b))^2) above it; p1, T1 upstream, p2 downstream.

With b = (2 / (gamma + 1))^(gamma / (gamma - 1)), that of a nozzle, phi as it stands here follows de Saint-Venant and
Wantzel's law within 0.4 % up to a ratio of 0.9 and 1.5 % up to 0.99; nearer to 1 it is laminar.
The numbers of a gas are here; `motion_kernel.mass_flow` is the law.
"""

from __future__ import annotations

import math
from functools import cache


@cache
def critical_ratio(heat_capacity_ratio: float) -> float:
    """b of a nozzle; its limit exp(-1/2) for an isothermal gas."""
    g = max(heat_capacity_ratio, 1 + 1e-9)
    return math.pow(2 / (g + 1), g / (g - 1))


@cache
def choked_flow(heat_capacity_ratio: float) -> float:
    """c*: mass flow times sqrt(R T) over area and pressure; 0.6847 for air."""
    g = max(heat_capacity_ratio, 1 + 1e-9)
    return math.sqrt(g) * math.pow(2 / (g + 1), (g + 1) / (2 * (g - 1)))
