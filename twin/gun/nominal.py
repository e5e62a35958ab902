"""The nominal gun: a fixed mass of gas expands adiabatically behind a sliding bullet (thesis eq.
2.13-2.18).

Glossary: Q gauge pressure, V0 tank volume, A projectile's cross section, L travel to the vent
holes, m bullet mass, mu friction coefficient, gamma heat capacity ratio, eta efficiency.

The gas law is applied to gauge pressure, as the thesis does; what that leaves out is an effect and
not part of the nominal law.

What no gas gun exceeds: the escape speed of its gas, and the work that its gas can do along the
barrel.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...array_types import Floats
from .bench import STANDARD_GRAVITY_M_S2, GunBench, checked
from .shot import GAS_CONSTANT, ROOM_K

__all__ = ["GunBench", "Trajectory", "muzzle_velocity", "tank_pressure_for", "trajectory"]

Status = Literal["left", "stopped in the barrel", "did not start"]


def muzzle_velocity(
    bench: GunBench, tank_pressure_pa: ArrayLike, bullet_mass_kg: ArrayLike
) -> NDArray[np.float64]:
    """Muzzle velocity (m/s), broadcast over pressures and masses.

    The work integral, times eta for v: m v^2 / 2 = Q0 V0 / (gamma - 1) [1 - (V0 / (V0 + A
    L))^(gamma - 1)] - mu m g L.

    A shot that does not leave the barrel has velocity 0. That is where this work is not positive:
    the net force only falls along the barrel, so a bullet that cannot start, or stops on its way,
    has no positive work at the end either.

    Parameters:
        bench: The gun.
        tank_pressure_pa: Gauge pressure of the tank, a number or an array.
        bullet_mass_kg: Mass of the bullet, a number or an array that broadcasts with the pressures.

    Raises:
        ValueError: For pressures that are negative or not finite, and for masses that are not
            positive and finite.

    Source:
        Thesis, eq. 2.16 and 2.18.
    """
    pressure = checked("tank_pressure_pa", tank_pressure_pa, zero_allowed=True)
    mass = checked("bullet_mass_kg", bullet_mass_kg)
    work = bench.work_per_pascal_m3 * pressure - bench.friction_work_j(mass)
    return np.asarray(bench.efficiency * np.sqrt(np.maximum(2 * work / mass, 0.0)))


def tank_pressure_for(
    bench: GunBench, muzzle_velocity_m_s: ArrayLike, bullet_mass_kg: ArrayLike
) -> NDArray[np.float64]:
    """Gauge pressure (Pa) that gives a muzzle velocity: `muzzle_velocity` solved for it,
    broadcasting.

    Parameters:
        bench: The gun.
        muzzle_velocity_m_s: Velocity that is wanted, a number or an array; at 0 the result is the
            pressure above which a bullet leaves the barrel.
        bullet_mass_kg: Mass of the bullet, a number or an array that broadcasts with the
            velocities.

    Raises:
        ValueError: For velocities that are negative or not finite, and for masses that are not
            positive and finite.
    """
    velocity = checked("muzzle_velocity_m_s", muzzle_velocity_m_s, zero_allowed=True)
    mass = checked("bullet_mass_kg", bullet_mass_kg)
    energy = mass * (velocity / bench.efficiency) ** 2 / 2
    return np.asarray((energy + bench.friction_work_j(mass)) / bench.work_per_pascal_m3)


@dataclass(frozen=True)
class Trajectory:
    """One shot along the barrel, in equal steps of time (arrays (points,), the last one at the
    end).

    Velocities are the ideal ones of eq. 2.17: eq. 2.18 applies the efficiency at the muzzle only. A
    shot that does not start has one point.
    """

    time_s: NDArray[np.float64]
    position_m: NDArray[np.float64]
    velocity_m_s: NDArray[np.float64]
    pressure_pa: NDArray[np.float64]
    exit_time_s: float  # NaN for a shot that does not leave
    muzzle_velocity_m_s: float  # eq. 2.18; 0 for a shot that does not leave
    status: Status


def trajectory(
    bench: GunBench, tank_pressure_pa: float, bullet_mass_kg: float, *, points: int = 200
) -> Trajectory:
    """The motion of one bullet to the vent holes, or to where friction stops it.

    Parameters:
        bench: The gun.
        tank_pressure_pa: Gauge pressure of the tank.
        bullet_mass_kg: Mass of the bullet.
        points: Number of points of the trajectory, in equal steps of time; 200 by default.

    Raises:
        ValueError: As `muzzle_velocity`.

    Source:
        Thesis, eq. 2.17, integrated.
    """
    pressure = float(checked("tank_pressure_pa", tank_pressure_pa, zero_allowed=True))
    mass = float(checked("bullet_mass_kg", bullet_mass_kg))
    drag = bench.friction_coefficient * STANDARD_GRAVITY_M_S2
    if pressure * bench.projectile_area_m2 / mass <= drag:
        rest = np.zeros(1)
        return Trajectory(rest, rest, rest, np.full(1, pressure), math.nan, 0.0, "did not start")
    time, state, exited = _integrate(bench, pressure, mass, points)
    return Trajectory(
        time,
        state[0],
        state[1],
        _gas_pressure(bench, pressure, state[0]),
        float(time[-1]) if exited else math.nan,
        bench.efficiency * float(state[1, -1]) if exited else 0.0,
        "left" if exited else "stopped in the barrel",
    )


def _gas_pressure(
    bench: GunBench, pressure: float, position: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Eq. 2.15."""
    expansion = 1 + bench.projectile_area_m2 * position / bench.tank_volume_m3
    return np.asarray(pressure * expansion**-bench.heat_capacity_ratio)


def _integrate(
    bench: GunBench, pressure: float, mass: float, points: int
) -> tuple[NDArray[np.float64], NDArray[np.float64], bool]:
    """Times (points,), position and velocity (2, points), and whether the bullet reached the vent
    holes."""
    from scipy.integrate import solve_ivp

    drag = bench.friction_coefficient * STANDARD_GRAVITY_M_S2

    def motion(_: float, state: NDArray[np.float64]) -> NDArray[np.float64]:
        force = _gas_pressure(bench, pressure, state[0]) * bench.projectile_area_m2
        return np.array([state[1], force / mass - drag])

    def at_vents(_: float, state: NDArray[np.float64]) -> float:
        return float(state[0] - bench.travel_m)

    def at_rest(_: float, state: NDArray[np.float64]) -> float:
        return float(state[1])

    at_vents.terminal, at_rest.terminal, at_rest.direction = True, True, -1.0  # type: ignore[attr-defined]
    run = solve_ivp(
        motion,
        (0.0, np.inf),  # the net force only falls: every shot ends at one of the events
        [0.0, 0.0],
        method="DOP853",
        events=(at_vents, at_rest),
        dense_output=True,
        rtol=1e-10,
        atol=1e-10 * bench.travel_m,
    )
    time = np.linspace(0.0, float(run.t[-1]), points)
    assert run.sol is not None and run.t_events is not None  # both were asked for
    return time, np.asarray(run.sol(time)), run.t_events[0].size > 0


def escape_speed_m_s(heat_capacity_ratio: float, temperature_k: float) -> float:
    """The speed 2 c0 / (gamma - 1) of a gas that expands into a vacuum from rest: 1,716 m/s for air
    of a room, infinite for an isothermal gas.

    Parameters:
        heat_capacity_ratio: gamma of the gas, 1 or more; 1 is isothermal.
        temperature_k: Absolute temperature of the gas at rest.

    Source:
        Courant and Friedrichs, Supersonic Flow and Shock Waves, section 39.
    """
    speed_of_sound = math.sqrt(heat_capacity_ratio * GAS_CONSTANT * temperature_k)
    return math.inf if heat_capacity_ratio == 1 else 2 * speed_of_sound / (heat_capacity_ratio - 1)


def barrel_work_j(
    bench: GunBench, tank_pressure_pa: ArrayLike, opposing_pressure_pa: ArrayLike
) -> Floats:
    """The most work on the bullet, broadcasting: the gas of the tank expands at the room's
    temperature, which takes heat from the walls and gives more than an adiabatic expansion, against
    the pressure ahead.

    W = max over V of (Q0 + B) V0 ln(V / V0) - B (V - V0), V up to V0 + A L; with B = 0 Q0 V0 ln(1 +
    A L / V0). Where the barrel is long the largest W is the energy of the tank's gas in its
    surroundings.

    Parameters:
        bench: The gun.
        tank_pressure_pa: Q0, gauge pressure of the tank, a number or an array.
        opposing_pressure_pa: B, absolute pressure ahead of the bullet, a number or an array; 0 for
            a vacuum.

    Source:
        Exergy: Moran and Shapiro, ch. 7.
    """
    gauge, ahead = (
        np.asarray(tank_pressure_pa, dtype=np.float64),
        np.asarray(opposing_pressure_pa, dtype=np.float64),
    )
    longest = 1 + bench.projectile_area_m2 * bench.travel_m / bench.tank_volume_m3
    absolute = gauge + ahead
    with np.errstate(divide="ignore", invalid="ignore"):
        even = np.where(
            ahead > 0, absolute / ahead, np.inf
        )  # V / V0 at which both pressures are the same
    growth = np.minimum(even, longest)
    return np.asarray(bench.tank_volume_m3 * (absolute * np.log(growth) - ahead * (growth - 1)))


def refuse_faster_than_gas(
    bench: GunBench, tank_pressure_pa: Floats, bullet_mass_kg: Floats
) -> None:
    """Refuses settings at which eq. 2.16 and 2.18 give more than the escape speed of the gas.

    Parameters:
        bench: The gun.
        tank_pressure_pa: Gauge pressures of the tank (n,).
        bullet_mass_kg: Masses of the bullets (n,).

    Raises:
        ValueError: For the first such setting.
    """
    velocity = muzzle_velocity(bench, tank_pressure_pa, bullet_mass_kg)
    most = escape_speed_m_s(bench.heat_capacity_ratio, ROOM_K)
    for first in np.flatnonzero(velocity > most)[:1]:
        raise ValueError(
            f"tank_pressure = {tank_pressure_pa[first] / 1e5:g} bar with bullet_mass = "
            f"{bullet_mass_kg[first]:g} kg: eq. 2.16 gives {velocity[first]:,.0f} m/s, but the gas "
            f"of the tank escapes no faster than {most:,.0f} m/s (2 c0 / (gamma - 1) at {ROOM_K:g} "
            "K); lower the pressure or take a heavier bullet"
        )


def beyond_energy(
    bench: GunBench, tank_pressure_pa: Floats, bullet_mass_kg: Floats, velocity_m_s: Floats
) -> NDArray[np.bool_]:
    """Which of n measured shots have more energy than the gas of the tank can do work along the
    barrel, (n,).

    Parameters:
        bench: The gun.
        tank_pressure_pa: Gauge pressures of the tank (n,).
        bullet_mass_kg: Masses of the bullets (n,).
        velocity_m_s: Measured velocities (n,).
    """
    return excess_velocity(bench, tank_pressure_pa, bullet_mass_kg, velocity_m_s) > 0


def excess_velocity(
    bench: GunBench, tank_pressure_pa: Floats, bullet_mass_kg: Floats, velocity_m_s: Floats
) -> Floats:
    """ln of measured velocities over the fastest that the gas of the tank can give by its work in
    the barrel, (n,).

    Parameters:
        bench: The gun.
        tank_pressure_pa: Gauge pressures of the tank (n,).
        bullet_mass_kg: Masses of the bullets (n,).
        velocity_m_s: Measured velocities (n,).
    """
    work = np.maximum(barrel_work_j(bench, tank_pressure_pa, 0.0), np.finfo(np.float64).tiny)
    return np.asarray(np.log(velocity_m_s) - np.log(2 * work / bullet_mass_kg) / 2)
