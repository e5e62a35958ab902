"""A shot by second laws that is followed past the exit: the tank's pressure while the breech
empties.

From the vents on the gas leaves through what the projectile's tail has uncovered of them, and
through the gap at the muzzle once the tail is out of the barrel. Development: a sharp-edged hole
with one discharge coefficient, and a valve that turns back along a straight line; sealed: Perry's
coefficient (Trans. ASME 71 (1949) 757), and the valve's disc; calibration: ISO 6358-1's ellipse of
a hole, and a poppet that comes back evenly. A valve that opens at once closes at once. After the
exit the tank's wall gives heat to the gas that is there: m cv (T_wall - T) / tau (Pourmovahed and
Otis, J. Dyn. Syst. Meas. Control 112 (1990) 116).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numba import njit

from ...array_types import Floats
from ..gun.build import GunBuild, Projectile
from ..gun.fire import velocity_at
from ..gun.gas import CP, CV, GAMMA, GAS_CONSTANT
from .gun import (
    AMBIENT,
    AREA,
    BORE,
    BREECH_M3,
    CLOSE_AT,
    CLOSE_S,
    DISC_VALVE,
    FIGURES,
    HOSE_M3_PA,
    MERGED,
    NEVER_S,
    OPEN_S,
    POPPET_VALVE,
    TANK_M3,
    VALVE_LAW,
    VALVE_M2,
    WALL_K,
    gas_state,
    hose_state,
    integrated,
    nozzle,
    perry_coefficient,
    rates,
    run_to_vents,
    shot_figures,
)
from .gun_calibration import HOLE_RATIO, sonic_flow

#: Behind the figures of a shot: vents (area, place, radius), muzzle (area, place), and the wall's
#: time constant.
VENT_M2, VENT_AT, VENT_R, MUZZLE_M2, MUZZLE_AT, WALL_S = range(FIGURES, FIGURES + 6)
_CHUNK_S = 0.1
#: A gun without an atmosphere empties to this (absolute): a chamber that is all but empty has no
#: temperature.
PUMPED_PA = 100.0


@dataclass(frozen=True)
class ValveClosing:
    """When a valve begins to close, from its opening on, how long it takes, and the time constant
    of the tank's wall.

    `at_s` is infinite for a valve that stays open. It may not begin before the shot has left the
    barrel.
    """

    at_s: float = math.inf
    takes_s: float = 0.1
    wall_s: float = math.inf


@dataclass(frozen=True, eq=False)
class FollowedShot:
    """Gauge pressure (n,) of the tank in Pa over times (n,) in s from the valve's opening on.

    The tail reaches the vents at `exit_s` (NaN where it does not) with `muzzle_velocity_m_s`, as
    `gun.muzzle_velocity_m_s` has it.
    """

    time_s: Floats
    tank_pressure_pa: Floats
    exit_s: float
    muzzle_velocity_m_s: float


def follow_shot(
    gun: GunBuild,
    strengths: Mapping[str, float],
    split: str,
    tank_pressure_pa: float,
    projectile: Projectile,
    *,
    until_s: float,
    closing: ValveClosing | None = None,
) -> FollowedShot:
    """A shot from a gauge pressure, until `until_s` after the valve's opening, or the exit where
    that is later.

    Raises `ValueError` for a valve that closes before the exit, `RuntimeError` where the integrator
    gives up.
    """
    closing = closing or ValveClosing()
    base = shot_figures(gun, strengths, split, projectile)
    time, rows, exit_s = run_to_vents(base, tank_pressure_pa, gun.vent_position_m)
    if not math.isfinite(exit_s):
        return FollowedShot(time, tank_gauge_pa(rows, base), math.nan, 0.0)
    if closing.at_s < exit_s:
        raise ValueError(
            f"the valve closes at {closing.at_s:.4g} s, before the exit at {exit_s:.4g} s"
        )
    velocity = float(velocity_at(time, rows[:, 6], rows[:, 7], np.array([exit_s]))[0])
    inside = int(np.searchsorted(time, exit_s))  # the first point that is not before the exit
    figures = np.append(base, np.zeros(6))
    figures[[VENT_M2, MUZZLE_M2]] = gun.vent_area_m2, gun.muzzle_area_m2
    if base[VALVE_LAW] != DISC_VALVE:
        figures[[VENT_M2, MUZZLE_M2]] *= gun.outlet_discharge
    figures[VENT_AT], figures[VENT_R], figures[MUZZLE_AT] = (
        gun.vent_position_m,
        gun.vent_diameter_m / 2,
        gun.barrel_length_m,
    )
    figures[WALL_S] = closing.wall_s
    figures[CLOSE_AT], figures[CLOSE_S] = min(closing.at_s, NEVER_S), closing.takes_s
    pressures = tank_gauge_pa(rows[:inside], figures)
    times, gauges, state = [time[:inside]], [pressures], rows[inside - 1]
    while (start := float(times[-1][-1])) < until_s - 1e-9:
        if figures[MERGED] and start >= figures[CLOSE_AT] - 1e-9:
            state, figures = _separated(state, figures)
        kinks = (figures[OPEN_S], figures[CLOSE_AT], figures[CLOSE_AT] + figures[CLOSE_S])
        stop = min(
            start + _CHUNK_S, until_s, *(float(kink) for kink in kinks if kink > start + 1e-6)
        )
        time, rows = integrated(emptying_rates, state, start, stop, figures)
        times.append(time[1:])
        gauges.append(tank_gauge_pa(rows[1:], figures))
        state = rows[-1]
    return FollowedShot(np.concatenate(times), np.concatenate(gauges), exit_s, velocity)


def tank_gauge_pa(states: Floats, figures: Floats) -> Floats:
    """Gauge pressure (n,) of the tank at states (n, 8)."""
    if figures[MERGED] and figures[HOSE_M3_PA] > 0:
        return np.array([_hose_gauge_pa(state, figures) for state in states])
    if figures[MERGED]:
        position = (
            states[:, 6]
            if figures.size <= MUZZLE_AT
            else np.minimum(states[:, 6], figures[MUZZLE_AT])
        )
        volume = figures[TANK_M3] + figures[BREECH_M3] + figures[AREA] * position
        return np.asarray((GAMMA - 1) * (states[:, 1] + states[:, 3]) / volume - figures[AMBIENT])
    return np.asarray((GAMMA - 1) * states[:, 1] / figures[TANK_M3] - figures[AMBIENT])


def _hose_gauge_pa(state: Floats, figures: Floats) -> float:
    """The same at one state (8,) of a tank that is one volume with a hose."""
    position = state[6] if figures.size <= MUZZLE_AT else min(state[6], figures[MUZZLE_AT])
    volume = figures[TANK_M3] + figures[BREECH_M3] + figures[AREA] * position
    pressure = hose_state(state[0] + state[2], state[1] + state[3], volume, figures)[0]
    return float(pressure - figures[AMBIENT])


def _separated(state: Floats, figures: Floats) -> tuple[Floats, Floats]:
    """State and figures of a tank that an ideal valve has cut off: mass and energy go by
    volumes."""
    f, after = figures.copy(), state.copy()
    barrel = f[BREECH_M3] + f[AREA] * min(state[6], f[MUZZLE_AT])
    share = barrel / (f[TANK_M3] + barrel)
    mass, energy = state[0] + state[2], state[1] + state[3]
    if f[HOSE_M3_PA] > 0:
        pressure, temperature, _ = hose_state(mass, energy, f[TANK_M3] + barrel, f)
        after[0], after[1] = (
            pressure * f[TANK_M3] / (GAS_CONSTANT * temperature),
            pressure * f[TANK_M3] / (GAMMA - 1),
        )
        after[2], after[3] = mass - after[0], energy - after[1]
        f[MERGED], f[VALVE_M2], f[OPEN_S] = 0.0, 0.0, 1e-3
        return after, f
    after[[0, 1]], after[[2, 3]] = (
        (1 - share) * np.array([mass, energy]),
        share * np.array([mass, energy]),
    )
    f[MERGED], f[VALVE_M2], f[OPEN_S] = 0.0, 0.0, 1e-3
    return after, f


@njit(cache=True)
def emptying_rates(time: float, state: Floats, f: Floats) -> Floats:
    """Rates (8,) as `gun.rates` has them, with the outflow through vents and muzzle and the heat of
    the tank's wall.

    A projectile that has left the barrel moves no gas any more.
    """
    gone = state[6] >= f[MUZZLE_AT]
    now = state.copy()
    if gone:
        now[6], now[7] = f[MUZZLE_AT], 0.0
    rate = rates(time, now, f)
    if gone:
        rate[6], rate[7] = (
            state[7],
            0.0,
        )  # it flies on: a rate that stopped here would hold the integrator here
    volume = f[BREECH_M3] + f[AREA] * now[6]
    tank = gas_state(now[0], now[1], f[TANK_M3])
    breech = hose_state(now[2], now[3], volume, f)
    if f[MERGED]:
        tank = hose_state(now[0] + now[2], now[1] + now[3], f[TANK_M3] + volume, f)
        breech = tank
    area = f[VENT_M2] * _uncovered(now[6] - f[VENT_AT], 2 * f[VENT_R])
    area += f[MUZZLE_M2] * _uncovered(state[6] - f[MUZZLE_AT], f[BORE])
    out, energy, ambient = 0.0, 0.0, max(f[AMBIENT], PUMPED_PA)
    if breech[0] > ambient:
        out = area * _hole(breech[0], breech[1], ambient / breech[0], f)
        energy = out * CP * breech[1]
    elif breech[0] < ambient:
        out = -area * _hole(ambient, f[WALL_K], breech[0] / ambient, f)
        energy = out * CP * f[WALL_K]
    chamber = (
        0 if f[MERGED] else 2
    )  # of one volume the tank's part is drained, which holds nearly all
    rate[chamber] -= out
    rate[chamber + 1] -= energy
    mass = now[0] + now[2] if f[MERGED] else now[0]
    rate[1] += max(mass, 0.0) * CV * (f[WALL_K] - tank[1]) / f[WALL_S]
    return rate


@njit(cache=True)
def _hole(pressure: float, temperature: float, ratio: float, f: Floats) -> float:
    """Mass flow (kg/s) through 1 m2 of the holes' area."""
    if f[VALVE_LAW] == POPPET_VALVE:
        return float(sonic_flow(pressure, temperature, ratio, HOLE_RATIO))
    flow: float = nozzle(pressure, temperature, ratio)
    return flow * perry_coefficient(ratio) if f[VALVE_LAW] == DISC_VALVE else flow


@njit(cache=True)
def _uncovered(past_m: float, diameter_m: float) -> float:
    """Share of a hole that a tail has uncovered, so far past its rim."""
    share: float = min(max(past_m / diameter_m, 0.0), 1.0)
    return share * share * (3 - 2 * share)
