"""The rates of `motion.derivative`, compiled: the same balances in the same order, from figures in one array."""

from __future__ import annotations

import math
from dataclasses import fields

import numpy as np
from numba import njit

from ...array_types import Floats
from .build import GunSetting
from .gas import (
    CHOKED,
    COLDEST_K,
    CP,
    CRITICAL_RATIO,
    CV,
    DEAD_SHARE,
    GAMMA,
    GAS_CONSTANT,
    HOTTEST_K,
    LAMINAR_SHARE,
    RANGEABILITY,
)
from .motion import AIR_VISCOSITY_PA_S, CREEP_M_S, STANDARD_DENSITY_KG_M3

Flow = tuple[float, float]

_NAMES = [field.name for field in fields(GunSetting) if field.name != "valve_way"]
# fmt: off
(TANK_M3, BREECH_M3, MUZZLE_M, TRAVEL_M, END_M, AREA_M2, MASS_KG, LENGTH_M, BORE_M, AMBIENT, TANK_PA, MERGED,
 VALVE_M2, CRITICAL, LEAK_M2, VENT_M2, VENT_M, VENT_R_M, MUZZLE_M2, COULOMB_N, BREAKAWAY_N, STRIBECK_M_S,
 SEAL_M2, COLUMN, ENTRANCE, TANK_W_K, BARREL_W_M_K) = range(len(_NAMES))
# fmt: on
AMBIENT_K = len(_NAMES)
AMBIENT_KG_M3 = AMBIENT_K + 1
#: From here on the moments of the valve's way, then its positions.
WAY = AMBIENT_KG_M3 + 1


def figures_of(setting: GunSetting) -> Floats:
    """The figures (29 + 2 k,) of a setting in its order; the surroundings' pressure in its place, the rest of them
    behind, and then moments and positions of the valve's way, k of each."""
    values = [getattr(setting, name) for name in _NAMES]
    ambient = setting.ambient
    values[AMBIENT] = ambient.pressure
    valve_way = setting.valve_way
    return np.array(
        [*values, ambient.temperature, ambient.density, *valve_way.moments_s, *valve_way.positions], dtype=np.float64
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
    ambient = (f[AMBIENT], f[AMBIENT_K], f[AMBIENT_KG_M3])
    end, end_w = _nozzle(ahead, ambient, before_m2)
    out, out_w = 0.0, 0.0
    if not sealed and behind_m2 != 0:
        out, out_w = _nozzle(breech, ambient, behind_m2)
    heat = _heat(x, tank, breech, ahead, f)
    force = (breech[0] - ahead[0]) * f[AREA_M2]
    resistance = _resistance(x, v, breech, ahead, f)
    behind, before = _swept(x, v, f)
    rate = np.empty(12)
    rate[0] = -valve
    rate[1] = -valve_w + heat[0]
    rate[2] = valve - leak - out
    rate[3] = valve_w - leak_w - out_w + heat[1] - breech[0] * behind
    rate[4] = leak - end
    rate[5] = leak_w - end_w + heat[2] + ahead[0] * before
    rate[6] = v
    rate[7] = 0.0 if held else (force - resistance) / f[MASS_KG]
    rate[8] = out + end
    rate[9] = out_w + end_w
    rate[10] = heat[0] + heat[1] + heat[2]
    rate[11] = resistance * v
    return rate


@njit(cache=True)
def _gas(mass: float, energy: float, volume: float) -> tuple[float, float, float]:
    if mass <= 0 or energy <= 0:
        return 0.0, COLDEST_K, 0.0
    temperature = min(max(energy / (mass * CV), COLDEST_K), HOTTEST_K)
    return (GAMMA - 1) * energy / volume, temperature, mass / volume


@njit(cache=True)
def _squeezed(last: float, volume: float) -> Flow:
    share = 1 / (1 + 2 * (last - volume) / last)
    return last * (1 + share) / 2, share**2


@njit(cache=True)
def _gases(
    state: Floats, f: Floats
) -> tuple[tuple[float, float, float], tuple[float, float, float], tuple[float, float, float]]:
    x = state[6]
    tank, breech = f[TANK_M3], f[BREECH_M3] + f[AREA_M2] * x
    ahead = f[AREA_M2] * (f[TRAVEL_M] + f[END_M] - x)
    if x > f[TRAVEL_M]:
        ahead = _squeezed(f[AREA_M2] * f[END_M], ahead)[0]
    column = _gas(state[4], state[5], ahead)
    if f[MERGED]:
        behind = _gas(state[0] + state[2], state[1] + state[3], tank + breech)
        return behind, behind, column
    if x < 0:
        breech = _squeezed(f[BREECH_M3], breech)[0]
    return _gas(state[0], state[1], tank), _gas(state[2], state[3], breech), column


@njit(cache=True)
def _swept(x: float, v: float, f: Floats) -> Flow:
    behind = f[AREA_M2] * v
    before = behind
    if x > f[TRAVEL_M]:
        before *= _squeezed(f[END_M], f[TRAVEL_M] + f[END_M] - x)[1]
    if x < 0 and not f[MERGED]:
        behind *= _squeezed(f[BREECH_M3], f[BREECH_M3] + f[AREA_M2] * x)[1]
    return behind, before


@njit(cache=True)
def _laminar(apart: float) -> float:
    return 1 / math.sqrt(math.sqrt(1 + (LAMINAR_SHARE / apart) ** 2))


@njit(cache=True)
def _through(up: tuple[float, float, float], ratio: float, area: float) -> float:
    unit = area * up[0] / math.sqrt(GAS_CONSTANT * up[1])
    if ratio <= CRITICAL_RATIO:
        return CHOKED * unit
    root = ratio ** ((GAMMA - 1) / GAMMA)
    share = 2 * GAMMA / (GAMMA - 1) * (ratio / root) ** 2 * (1 - root)
    return unit * math.sqrt(max(share, 0.0)) * _laminar(1 - ratio)


@njit(cache=True)
def _ellipse(up: tuple[float, float, float], ratio: float, area: float, critical: float) -> float:
    unit = CHOKED * area * up[0] / math.sqrt(GAS_CONSTANT * up[1])
    if ratio <= critical:
        return unit
    share = 1 - ((ratio - critical) / (1 - critical)) ** 2
    return unit * math.sqrt(share) * _laminar(1 - ratio)


@njit(cache=True)
def _nozzle(first: tuple[float, float, float], second: tuple[float, float, float], area: float) -> Flow:
    if first[0] > second[0]:
        mass = _through(first, second[0] / first[0], area)
        return mass, mass * CP * first[1]
    if first[0] < second[0]:
        mass = -_through(second, first[0] / second[0], area)
        return mass, mass * CP * second[1]
    return 0.0, 0.0


@njit(cache=True)
def _valve(time: float, tank: tuple[float, float, float], breech: tuple[float, float, float], f: Floats) -> Flow:
    if f[MERGED]:
        return 0.0, 0.0
    area = f[VALVE_M2] * _open_share(_position(time, f))
    if area == 0:
        return 0.0, 0.0
    if tank[0] > breech[0]:
        mass = _ellipse(tank, breech[0] / tank[0], area, f[CRITICAL])
        return mass, mass * CP * tank[1]
    if tank[0] < breech[0]:
        mass = -_ellipse(breech, tank[0] / breech[0], area, f[CRITICAL])
        return mass, mass * CP * breech[1]
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
def _open_share(position: float) -> float:
    travel = (position - DEAD_SHARE) / (1 - DEAD_SHARE)
    if travel <= 0:
        return 0.0
    if travel >= 1:
        return 1.0
    return math.expm1(travel * math.log(RANGEABILITY)) / (RANGEABILITY - 1)


@njit(cache=True)
def _passed(edge: float, f: Floats) -> float:
    share = (edge - f[VENT_M]) / (2 * f[VENT_R_M])
    inside: float = min(max(share, 0.0), 1.0)
    return inside * inside * (3 - 2 * inside)


@njit(cache=True)
def _heat(
    x: float,
    tank: tuple[float, float, float],
    breech: tuple[float, float, float],
    ahead: tuple[float, float, float],
    f: Floats,
) -> tuple[float, float, float]:
    if f[TANK_W_K] == 0:
        return 0.0, 0.0, 0.0
    wall, film = f[AMBIENT_K], f[BARREL_W_M_K] / STANDARD_DENSITY_KG_M3
    behind = film * max(x, 0.0) * breech[2]
    before = film * max(f[TRAVEL_M] - x, 0.0) * ahead[2]
    return f[TANK_W_K] * (wall - tank[1]), behind * (wall - breech[1]), before * (wall - ahead[1])


@njit(cache=True)
def _column(v: float, density: float, length: float, minor: float, f: Floats) -> float:
    speed = abs(v)
    reynolds = max(density * speed * f[BORE_M] / AIR_VISCOSITY_PA_S, 1.0)
    factor = max(64 / reynolds, 0.3164 * reynolds**-0.25)
    heads = factor * max(length, 0.0) / f[BORE_M] + minor
    force: float = f[COLUMN] * heads * density * v * speed / 2 * f[AREA_M2]
    return force


@njit(cache=True)
def _resistance(
    x: float, v: float, breech: tuple[float, float, float], ahead: tuple[float, float, float], f: Floats
) -> float:
    hump = f[BREAKAWAY_N] * math.exp(-min((v / f[STRIBECK_M_S]) ** 2, 700.0))
    seal = f[SEAL_M2] * max(breech[0] - ahead[0], 0.0)
    friction: float = (f[COULOMB_N] + hump + seal) * math.tanh(v / CREEP_M_S)
    if f[COLUMN] == 0:
        return friction
    behind = _column(v, breech[2], x, f[ENTRANCE], f)
    before = _column(v, ahead[2], f[MUZZLE_M] - x - f[LENGTH_M], 0.0, f)
    return friction + behind + before
