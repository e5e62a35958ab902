"""The gun in closed form: eq. 2.16 with any index, dead volume, pressure ahead and constant friction.

Work along the barrel, with V = V0 + Vd, P the law's pressure after filling, B the pressure ahead and F the friction:
W(x) = P V / (n - 1) [1 - (V / (V + A x))^(n - 1)] - (B A + F) x, and m v^2 / 2 = W(L).
"""

from __future__ import annotations

import numpy as np

from ...array_types import Floats
from .shot import ShotInputs

# A Gauss rule over s in x = L s^2, in which speed begins linearly.
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(48)
_PHASES, _WEIGHTS = (_NODES + 1) / 2, _WEIGHTS / 2


def net_work_j(shot: ShotInputs, position_m: Floats) -> Floats:
    """W at positions (..., n)."""
    from scipy.special import exprel

    growth = np.log1p(shot.area_m2 * position_m / shot.volume_m3)
    # exprel keeps the digits for large tanks, and is the isothermal law at an index of one.
    work = shot.filled_pressure_pa * shot.volume_m3 * growth * exprel((1 - shot.polytropic_index) * growth)
    return np.asarray(work - (shot.opposing_pressure_pa * shot.area_m2 + shot.friction_n) * position_m)


def starting_force_n(shot: ShotInputs) -> Floats:
    """On the projectile at rest, (n,)."""
    return np.asarray((shot.filled_pressure_pa - shot.opposing_pressure_pa) * shot.area_m2 - shot.friction_n)


def ideal_velocity_m_s(shot: ShotInputs) -> Floats:
    """At the vent holes, (n,), without the efficiency; 0 for a shot that does not get there."""
    return np.asarray(np.sqrt(np.maximum(2 * net_work_j(shot, shot.travel_m) / shot.bullet_mass_kg, 0.0)))


def travel_time_s(shot: ShotInputs) -> Floats:
    """Until the vent holes, (n,), for shots that get there: the integral of dx / v."""
    phases = _PHASES[:, None]
    energy = net_work_j(shot, shot.travel_m * phases**2)
    speed = np.sqrt(2 * energy / shot.bullet_mass_kg)
    return np.asarray(_WEIGHTS @ (2 * shot.travel_m * phases / speed))
