"""What no gas gun exceeds: the escape speed of its gas, and the work that its gas can do along the barrel."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...array_types import Floats
from .bench import GunBench
from .nominal import muzzle_velocity
from .shot import GAS_CONSTANT, ROOM_K


def escape_speed_m_s(heat_capacity_ratio: float, temperature_k: float) -> float:
    """2 c0 / (gamma - 1): of a gas that expands into a vacuum from rest (Courant and Friedrichs, Supersonic Flow and
    Shock Waves, section 39); 1,716 m/s for air of a room. Infinite for an isothermal gas."""
    speed_of_sound = math.sqrt(heat_capacity_ratio * GAS_CONSTANT * temperature_k)
    return math.inf if heat_capacity_ratio == 1 else 2 * speed_of_sound / (heat_capacity_ratio - 1)


def barrel_work_j(bench: GunBench, tank_pressure_pa: ArrayLike, opposing_pressure_pa: ArrayLike) -> Floats:
    """The most work on the bullet, broadcasting: the gas of the tank expands at the room's temperature, which takes
    heat from the walls and gives more than an adiabatic expansion, against the pressure ahead.

    W = max over V of (Q0 + B) V0 ln(V / V0) - B (V - V0), V up to V0 + A L; with B = 0 Q0 V0 ln(1 + A L / V0).
    Where the barrel is long the largest W is the energy of the tank's gas in its surroundings (exergy: Moran and
    Shapiro, ch. 7).
    """
    gauge, ahead = np.asarray(tank_pressure_pa, dtype=np.float64), np.asarray(opposing_pressure_pa, dtype=np.float64)
    longest = 1 + bench.projectile_area_m2 * bench.travel_m / bench.tank_volume_m3
    absolute = gauge + ahead
    with np.errstate(divide="ignore", invalid="ignore"):
        even = np.where(ahead > 0, absolute / ahead, np.inf)  # V / V0 at which both pressures are the same
    growth = np.minimum(even, longest)
    return np.asarray(bench.tank_volume_m3 * (absolute * np.log(growth) - ahead * (growth - 1)))


def refuse_faster_than_gas(bench: GunBench, tank_pressure_pa: Floats, bullet_mass_kg: Floats) -> None:
    """Raises `ValueError` for the first of n settings at which eq. 2.16 and 2.18 give more than the escape speed."""
    velocity = muzzle_velocity(bench, tank_pressure_pa, bullet_mass_kg)
    most = escape_speed_m_s(bench.heat_capacity_ratio, ROOM_K)
    for first in np.flatnonzero(velocity > most)[:1]:
        raise ValueError(
            f"tank_pressure = {tank_pressure_pa[first] / 1e5:g} bar with bullet_mass = {bullet_mass_kg[first]:g} kg: "
            f"eq. 2.16 gives {velocity[first]:,.0f} m/s, but the gas of the tank escapes no faster than "
            f"{most:,.0f} m/s (2 c0 / (gamma - 1) at {ROOM_K:g} K); lower the pressure or take a heavier bullet"
        )


def beyond_energy(
    bench: GunBench, tank_pressure_pa: Floats, bullet_mass_kg: Floats, velocity_m_s: Floats
) -> NDArray[np.bool_]:
    """Which of n measured shots have more energy than the gas of the tank can do work along the barrel."""
    return np.asarray(bullet_mass_kg * velocity_m_s**2 / 2 > barrel_work_j(bench, tank_pressure_pa, 0.0))
