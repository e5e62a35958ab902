"""One shot of the virtual gun."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from ...array_types import Floats
from ..effects import Effects
from .build import GunBuild, Projectile
from .curve import crossings, position_at, velocity_at
from .gas import GAMMA
from .integrate import integrate
from .motion import ENERGY_OUT, HEAT_IN, MASS_OUT, RESISTED, V, X, volumes
from .setting import GunSetting, setting_of
from .truth import Ledger, ShotTruth
from .valve import ValveWay

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
