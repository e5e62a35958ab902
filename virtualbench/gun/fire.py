"""One shot of the virtual gun.

Position over time between the points of a shot: cubics that have its positions and velocities (Hermite).

What really happened in one shot.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from ..effects import Effects
from .build import GunBuild, GunSetting, Projectile, setting_of
from .gas import GAMMA, ValveWay
from .integrate import integrate
from .motion import ENERGY_OUT, HEAT_IN, MASS_OUT, RESISTED, V, X, volumes


def position_at(time_s: Floats, position_m: Floats, velocity_m_s: Floats, moment_s: Floats) -> Floats:
    """Position (k,) at moments (k,), from points (n,); before the first and after the last it stays where it is."""
    k, step, share = _place(time_s, moment_s)
    rest = 1 - share
    ends = rest**2 * (1 + 2 * share) * position_m[k] + share**2 * (3 - 2 * share) * position_m[k + 1]
    return np.asarray(ends + share * rest * step * (rest * velocity_m_s[k] - share * velocity_m_s[k + 1]))


def velocity_at(time_s: Floats, position_m: Floats, velocity_m_s: Floats, moment_s: Floats) -> Floats:
    """The slope of `position_at` (k,)."""
    k, step, share = _place(time_s, moment_s)
    rest = 1 - share
    chord = 6 * share * rest * (position_m[k + 1] - position_m[k]) / step
    return np.asarray(chord + rest * (1 - 3 * share) * velocity_m_s[k] + share * (3 * share - 2) * velocity_m_s[k + 1])


def _place(time_s: Floats, moment_s: Floats) -> tuple[NDArray[np.intp], Floats, Floats]:
    """The step in which each moment lies, its length, and the share of it that has gone."""
    moment = np.clip(moment_s, time_s[0], time_s[-1])
    k = np.clip(np.searchsorted(time_s, moment, side="right") - 1, 0, time_s.size - 2)
    step = time_s[k + 1] - time_s[k]
    return k, step, (moment - time_s[k]) / step


def crossings(time_s: Floats, position_m: Floats, velocity_m_s: Floats, level_m: float) -> Floats:
    """Moments (k,) at which the way passes a level, in order, by bisection within the steps that straddle it."""
    side = np.sign(position_m - level_m)
    k = np.flatnonzero(side[:-1] * side[1:] < 0)
    low, high, start = time_s[k].copy(), time_s[k + 1].copy(), side[k]
    for _ in range(50):
        middle = (low + high) / 2
        before = np.sign(position_at(time_s, position_m, velocity_m_s, middle) - level_m) == start
        low, high = np.where(before, middle, low), np.where(before, high, middle)
    return np.sort(np.append(high, time_s[side == 0]))


_truth__all__ = ["Ledger", "ShotTruth"]


@dataclass(frozen=True)
class Ledger:
    """The books of a shot (n,): what the chambers hold, and what has left them since the start."""

    gas_mass_kg: Floats
    gas_energy_j: Floats
    mass_out_kg: Floats
    energy_out_j: Floats
    heat_in_j: Floats
    resisted_j: Floats


@dataclass(frozen=True)
class ShotTruth:
    """Arrays are (n,) over `time_s`, which increases from 0, the moment at which the valve begins to turn.

    Pressures are gauge against the surroundings. A projectile that does not reach the vents has muzzle velocity 0 and
    exit time NaN; one that does not reach the plate has impact velocity 0 and impact time NaN.
    """

    time_s: Floats
    tank_pressure_pa: Floats
    breech_pressure_pa: Floats
    ahead_pressure_pa: Floats
    position_m: Floats  # of the projectile's tail, from where it starts
    velocity_m_s: Floats
    muzzle_velocity_m_s: float  # when the tail reaches the vents (thesis, section 2.3)
    exit_time_s: float
    impact_velocity_m_s: float  # when the nose first meets the plate
    impact_time_s: float
    laser_blocked: tuple[tuple[float, float], ...]  # (start_s, stop_s) of each whole passage, there and back
    laser_position_m: float
    ledger: Ledger
    port_opens_s: float = 0.0  # the ball turns before its port opens; infinite where it never does


__all__ = ["GunBuild", "Projectile", "ShotTruth", "fire"]


def fire(
    gun: GunBuild,
    effects: Effects,
    tank_pressure_pa: float,
    projectile: Projectile,
    rng: np.random.Generator,
    *,
    until_s: float = 1.2,
    restitution: float = 0.35,
    tightness: float = 1.0,
    valve_way: ValveWay | None = None,
) -> ShotTruth:
    """A shot from `tank_pressure_pa` (gauge), followed for `until_s` from the valve's first turn.

    Open chambers with balances of mass and energy (perfect gas), flow by ISO 6358 (valve) and the isentropic nozzle
    (clearance, vents, muzzle), friction with a Stribeck hump; `setting.setting_of` says what each strength means.
    `valve_way` is what the controller lets the valve do; without it, it opens within the gun's own time and stays open.
    `restitution` is the plate's; `tightness` multiplies the integrator's tolerances. Raises `ValueError` for a
    pressure that is negative or not finite and for what the barrel cannot shoot; `RuntimeError` where LSODA gives up.
    """
    _check(tank_pressure_pa, until_s, restitution)
    setting = setting_of(gun, effects, float(tank_pressure_pa), projectile, rng, valve_way)
    time, state, strike = integrate(setting, until_s, restitution, tightness)
    tank, breech, ahead = _gauge_pressures(setting, state)
    projectile_motion = time, state[:, X], state[:, V]
    exits = crossings(*projectile_motion, gun.vent_position_m)
    return ShotTruth(
        time_s=time,
        tank_pressure_pa=tank,
        breech_pressure_pa=breech,
        ahead_pressure_pa=ahead,
        position_m=state[:, X],
        velocity_m_s=state[:, V],
        muzzle_velocity_m_s=float(velocity_at(*projectile_motion, exits[:1])[0]) if exits.size else 0.0,
        exit_time_s=float(exits[0]) if exits.size else math.nan,
        impact_velocity_m_s=strike.velocity_m_s if strike else 0.0,
        impact_time_s=strike.time_s if strike else math.nan,
        laser_blocked=_passages(projectile_motion, gun.laser_position_m, projectile.length_m),
        laser_position_m=gun.laser_position_m,
        ledger=_ledger(state),
        port_opens_s=setting.valve_way.port_opens_s,
    )


def _check(tank_pressure_pa: float, until_s: float, restitution: float) -> None:
    if not (math.isfinite(tank_pressure_pa) and tank_pressure_pa >= 0):
        raise ValueError(f"tank_pressure_pa = {tank_pressure_pa!r}: expected 0 or more, gauge")
    if not (math.isfinite(until_s) and until_s > 0):
        raise ValueError(f"until_s = {until_s!r}: expected a positive time")
    if not 0 <= restitution < 1:
        raise ValueError(f"restitution = {restitution!r}: expected 0 or more and less than 1")


def _gauge_pressures(setting: GunSetting, state: Floats) -> tuple[Floats, Floats, Floats]:
    tank, breech, ahead = volumes(setting, state[:, X])
    energy = (GAMMA - 1) * state[:, 1:6:2].T
    if setting.merged:
        first = second = (energy[0] + energy[1]) / (tank + breech)
    else:
        first, second = energy[0] / tank, energy[1] / breech
    ambient = setting.ambient.pressure
    return first - ambient, second - ambient, energy[2] / ahead - ambient


def _passages(way: tuple[Floats, Floats, Floats], laser: float, length: float) -> tuple[tuple[float, float], ...]:
    """From one end of the projectile in the beam to the other, whichever way it moves."""
    edges = np.sort(np.concatenate([crossings(*way, laser - length), crossings(*way, laser)]))
    middles = position_at(*way, (edges[:-1] + edges[1:]) / 2)
    inside = (laser - length < middles) & (middles < laser)
    return tuple((a, b) for (a, b), within in zip(pairwise(edges.tolist()), inside, strict=True) if within)


def _ledger(state: Floats) -> Ledger:
    return Ledger(
        gas_mass_kg=state[:, 0:6:2].sum(axis=1),
        gas_energy_j=state[:, 1:6:2].sum(axis=1),
        mass_out_kg=state[:, MASS_OUT],
        energy_out_j=state[:, ENERGY_OUT],
        heat_in_j=state[:, HEAT_IN],
        resisted_j=state[:, RESISTED],
    )
