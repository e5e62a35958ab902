"""The rates of `motion.derivative`, compiled: the same balances in the same order, from figures in
one array."""

from __future__ import annotations

import math
from dataclasses import fields

import numpy as np
from numba import njit

from ...array_types import Floats
from .build import GunSetting
from .gas import CP, Gas, gas_of, iso6358_flow, nozzle_flow, open_share
from .motion import AIR_VISCOSITY_PA_S, CREEP_M_S, STANDARD_DENSITY_KG_M3, squeezed

Flow = tuple[float, float]

_NAMES = [field.name for field in fields(GunSetting) if field.name != "valve_way"]
# fmt: off
(TANK_M3, BREECH_M3, MUZZLE_M, TRAVEL_M, END_M, AREA_M2, MASS_KG, LENGTH_M, BORE_M, AMBIENT,
TANK_PA, MERGED,
 VALVE_M2, CRITICAL, LEAK_M2, VENT_M2, VENT_M, VENT_R_M, MUZZLE_M2, COULOMB_N, BREAKAWAY_N,
 STRIBECK_M_S,
 SEAL_M2, COLUMN, ENTRANCE, TANK_W_K, BARREL_W_M_K) = range(len(_NAMES))
# fmt: on
AMBIENT_K = len(_NAMES)
AMBIENT_KG_M3 = AMBIENT_K + 1
#: From here on the moments of the valve's way, then its positions.
WAY = AMBIENT_KG_M3 + 1


def figures_of(setting: GunSetting) -> Floats:
    """The figures (29 + 2 k,) of a setting in its order; the surroundings' pressure in its place,
    the rest of them behind, and then moments and positions of the valve's way, k of each."""
    values = [getattr(setting, name) for name in _NAMES]
    ambient = setting.ambient
    values[AMBIENT] = ambient.pressure
    valve_way = setting.valve_way
    return np.array(
        [*values, ambient.temperature, ambient.density, *valve_way.moments_s, *valve_way.positions],
        dtype=np.float64,
    )


@njit(cache=True)
def rates(time: float, state: Floats, f: Floats, held: bool, sealed: bool) -> Floats:
    """Rates (12,) of the state (12,), as `motion.derivative` gives them for the figures `f`."""
    x, v = state[6], 0.0 if held else state[7]
    tank, breech, ahead = _gases(state, f)
    valve, valve_w = _valve(time, tank, breech, f)
    leak, leak_w = _nozzle(breech, ahead, f[LEAK_M2])
    behind_m2 = f[VENT_M2] * _passed(x, f)
    before_m2 = f[VENT_M2] * (1 - _passed(x + f[LENGTH_M], f)) + f[MUZZLE_M2]
    ambient = Gas(f[AMBIENT], f[AMBIENT_K], f[AMBIENT_KG_M3])
    end, end_w = _nozzle(ahead, ambient, before_m2)
    out, out_w = 0.0, 0.0
    if not sealed and behind_m2 != 0:
        out, out_w = _nozzle(breech, ambient, behind_m2)
    heat = _heat(x, tank, breech, ahead, f)
    force = (breech.pressure - ahead.pressure) * f[AREA_M2]
    resistance = _resistance(x, v, breech, ahead, f)
    behind, before = _swept(x, v, f)
    rate = np.empty(12)
    rate[0] = -valve
    rate[1] = -valve_w + heat[0]
    rate[2] = valve - leak - out
    rate[3] = valve_w - leak_w - out_w + heat[1] - breech.pressure * behind
    rate[4] = leak - end
    rate[5] = leak_w - end_w + heat[2] + ahead.pressure * before
    rate[6] = v
    rate[7] = 0.0 if held else (force - resistance) / f[MASS_KG]
    rate[8] = out + end
    rate[9] = out_w + end_w
    rate[10] = heat[0] + heat[1] + heat[2]
    rate[11] = resistance * v
    return rate


@njit(cache=True)
def _gases(state: Floats, f: Floats) -> tuple[Gas, Gas, Gas]:
    x = state[6]
    tank, breech = f[TANK_M3], f[BREECH_M3] + f[AREA_M2] * x
    ahead = f[AREA_M2] * (f[TRAVEL_M] + f[END_M] - x)
    if x > f[TRAVEL_M]:
        ahead = squeezed(f[AREA_M2] * f[END_M], ahead)[0]
    column = gas_of(state[4], state[5], ahead)
    if f[MERGED]:
        behind = gas_of(state[0] + state[2], state[1] + state[3], tank + breech)
        return behind, behind, column
    if x < 0:
        breech = squeezed(f[BREECH_M3], breech)[0]
    return gas_of(state[0], state[1], tank), gas_of(state[2], state[3], breech), column


@njit(cache=True)
def _swept(x: float, v: float, f: Floats) -> Flow:
    behind = f[AREA_M2] * v
    before = behind
    if x > f[TRAVEL_M]:
        before *= squeezed(f[END_M], f[TRAVEL_M] + f[END_M] - x)[1]
    if x < 0 and not f[MERGED]:
        behind *= squeezed(f[BREECH_M3], f[BREECH_M3] + f[AREA_M2] * x)[1]
    return behind, before


@njit(cache=True)
def _nozzle(first: Gas, second: Gas, area: float) -> Flow:
    if first.pressure > second.pressure:
        mass = nozzle_flow(first, second.pressure / first.pressure, area)
        return mass, mass * CP * first.temperature
    if first.pressure < second.pressure:
        mass = -nozzle_flow(second, first.pressure / second.pressure, area)
        return mass, mass * CP * second.temperature
    return 0.0, 0.0


@njit(cache=True)
def _valve(time: float, tank: Gas, breech: Gas, f: Floats) -> Flow:
    if f[MERGED]:
        return 0.0, 0.0
    area = f[VALVE_M2] * open_share(_position(time, f))
    if area == 0:
        return 0.0, 0.0
    if tank.pressure > breech.pressure:
        mass = iso6358_flow(tank, breech.pressure / tank.pressure, area, f[CRITICAL])
        return mass, mass * CP * tank.temperature
    if tank.pressure < breech.pressure:
        mass = -iso6358_flow(breech, tank.pressure / breech.pressure, area, f[CRITICAL])
        return mass, mass * CP * breech.temperature
    return 0.0, 0.0


@njit(cache=True)
def _position(time: float, f: Floats) -> float:
    count = (f.size - WAY) // 2
    last, positions = WAY + count - 1, count
    if time >= f[last]:
        return float(f[last + positions])
    if time < f[WAY]:
        return float(f[WAY + positions])
    k = WAY
    while f[k + 1] <= time:
        k += 1
    share = (time - f[k]) / (f[k + 1] - f[k])
    return float(f[k + positions] + (f[k + positions + 1] - f[k + positions]) * share)


@njit(cache=True)
def _passed(edge: float, f: Floats) -> float:
    share = (edge - f[VENT_M]) / (2 * f[VENT_R_M])
    inside: float = min(max(share, 0.0), 1.0)
    return inside * inside * (3 - 2 * inside)


@njit(cache=True)
def _heat(x: float, tank: Gas, breech: Gas, ahead: Gas, f: Floats) -> tuple[float, float, float]:
    if f[TANK_W_K] == 0:
        return 0.0, 0.0, 0.0
    wall, film = f[AMBIENT_K], f[BARREL_W_M_K] / STANDARD_DENSITY_KG_M3
    behind = film * max(x, 0.0) * breech.density
    before = film * max(f[TRAVEL_M] - x, 0.0) * ahead.density
    return (
        f[TANK_W_K] * (wall - tank.temperature),
        behind * (wall - breech.temperature),
        before * (wall - ahead.temperature),
    )


@njit(cache=True)
def _column(v: float, density: float, length: float, minor: float, f: Floats) -> float:
    speed = abs(v)
    reynolds = max(density * speed * f[BORE_M] / AIR_VISCOSITY_PA_S, 1.0)
    factor = max(64 / reynolds, 0.3164 * reynolds**-0.25)
    heads = factor * max(length, 0.0) / f[BORE_M] + minor
    force: float = f[COLUMN] * heads * density * v * speed / 2 * f[AREA_M2]
    return force


@njit(cache=True)
def _resistance(x: float, v: float, breech: Gas, ahead: Gas, f: Floats) -> float:
    hump = f[BREAKAWAY_N] * math.exp(-min((v / f[STRIBECK_M_S]) ** 2, 700.0))
    seal = f[SEAL_M2] * max(breech.pressure - ahead.pressure, 0.0)
    friction: float = (f[COULOMB_N] + hump + seal) * math.tanh(v / CREEP_M_S)
    if f[COLUMN] == 0:
        return friction
    behind = _column(v, breech.density, x, f[ENTRANCE], f)
    before = _column(v, ahead.density, f[MUZZLE_M] - x - f[LENGTH_M], 0.0, f)
    return friction + behind + before
