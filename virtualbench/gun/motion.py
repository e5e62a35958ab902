"""The balances of one shot: mass and energy of three chambers (tank, breech, column ahead), and the
projectile.

What holds the projectile back: sliding friction with its Stribeck hump, seal drag, and the air
column's losses.
"""

from __future__ import annotations

import math
from typing import NamedTuple, TypeVar

import numpy as np
from numba import njit

from ...array_types import Floats
from .build import GunSetting
from .gas import CV, Gas, exchange, gas_of, iso6358_flow, nozzle_flow, open_share

#: Friction rises from 0 to its full value over this speed, as tanh(v / v0). That replaces the jump
#: at rest, where no integrator gets past; a projectile that should stick creeps by less than 0.1 mm
#: in 0.1 s.
CREEP_M_S = 1e-3
AIR_VISCOSITY_PA_S = 1.82e-5


def sliding_friction(setting: GunSetting, velocity: float, pressure_difference: float) -> float:
    """Force (N) against the motion, of the sign of `velocity`.

    (F_c + F_b exp(-(v / v_s)^2) + k A max(dp, 0)) tanh(v / v0): Coulomb, breakaway hump, and a seal
    that the gas presses on the wall.
    """
    hump = setting.breakaway_force_n * math.exp(
        -min((velocity / setting.stribeck_velocity_m_s) ** 2, 700.0)
    )
    seal = setting.seal_area_m2 * max(pressure_difference, 0.0)
    return (setting.coulomb_force_n + hump + seal) * math.tanh(velocity / CREEP_M_S)


def column_loss(
    setting: GunSetting, velocity: float, gas: Gas, length_m: float, minor_loss: float
) -> float:
    """Force (N) of the wall on an air column that moves with the projectile: (f l / D + K) rho v
    |v| / 2 A.

    Darcy's friction factor by Hagen-Poiseuille and Blasius, whichever is larger.
    """
    speed = abs(velocity)
    reynolds = max(gas.density * speed * setting.bore_m / AIR_VISCOSITY_PA_S, 1.0)
    factor: float = max(64 / reynolds, 0.3164 * reynolds**-0.25)
    heads = factor * max(length_m, 0.0) / setting.bore_m + minor_loss
    return setting.column_losses * heads * gas.density * velocity * speed / 2 * setting.area_m2


Position = TypeVar("Position", float, Floats)

#: The state: mass (kg) and energy (J) of each chamber, position and velocity, and the ledger: mass
#: and enthalpy gone to the surroundings, heat taken from the walls, work done against friction.
STATES = 12
X, V, MASS_OUT, ENERGY_OUT, HEAT_IN, RESISTED = range(6, 12)
TOLERANCES = np.array([1e-9, 1e-4, 1e-9, 1e-4, 1e-9, 1e-4, 1e-6, 1e-5, 1e-9, 1e-4, 1e-4, 1e-4])


#: Where the heat transfer coefficient holds.
STANDARD_DENSITY_KG_M3 = 1.204


def initial_state(setting: GunSetting) -> Floats:
    """Tank at its pressure, the rest at the surroundings', all at their temperature, and the
    projectile at rest."""
    state = np.zeros(STATES)
    ambient = setting.ambient
    pressures = (setting.tank_pressure_pa, ambient.pressure, ambient.pressure)
    for chamber, (pressure, volume) in enumerate(
        zip(pressures, volumes(setting, 0.0), strict=True)
    ):
        state[2 * chamber] = pressure / ambient.pressure * ambient.density * volume
        state[2 * chamber + 1] = state[2 * chamber] * CV * ambient.temperature
    return state


def volumes(setting: GunSetting, position: Position) -> tuple[float, Position, Position]:
    """Volumes (m3) of tank, breech and column ahead; the air that moves at the gap counts as a
    length of the column."""
    breech = setting.breech_volume_m3 + setting.area_m2 * position
    return (
        setting.tank_volume_m3,
        breech,
        setting.area_m2 * (setting.travel_m + setting.end_m - position),
    )


def gases(setting: GunSetting, state: list[float]) -> tuple[Gas, Gas, Gas]:
    """Tank, breech and column ahead. Without a valve the first two are one."""
    tank, breech, ahead = volumes(setting, state[X])
    if state[X] > setting.travel_m:
        ahead = squeezed(setting.area_m2 * setting.end_m, ahead)[0]
    column = gas_of(state[4], state[5], ahead)
    if setting.merged:
        behind = gas_of(state[0] + state[2], state[1] + state[3], tank + breech)
        return behind, behind, column
    if state[X] < 0:
        breech = squeezed(setting.breech_volume_m3, breech)[0]
    return gas_of(state[0], state[1], tank), gas_of(state[2], state[3], breech), column


@njit(cache=True)
def squeezed(last: float, volume: float) -> tuple[float, float]:
    """A volume (m3) past its end, where only `last` is left, and how fast it still shrinks (1 at
    the end, then less).

    The integrator looks past the ends of the barrel before the strike is found: there it must find
    a gas.
    """
    share = 1 / (1 + 2 * (last - volume) / last)
    return last * (1 + share) / 2, share**2


class Phase(NamedTuple):
    """`held`: the projectile rests against the plate; `sealed`: its tail has not yet reached the
    vents."""

    held: bool
    sealed: bool


def derivative(time: float, array: Floats, setting: GunSetting, phase: Phase) -> list[float]:
    """Rates of the state."""
    state = array.tolist()
    position, velocity = state[X], 0.0 if phase.held else state[V]
    tank, breech, ahead = gases(setting, state)
    valve, valve_enthalpy = _valve(setting, time, tank, breech)
    leak, leak_enthalpy = exchange(breech, ahead, nozzle_flow, setting.leak_area_m2)
    (out, out_enthalpy), (end, end_enthalpy) = _outlets(
        setting, position, breech, ahead, phase.sealed
    )
    heat = _heat(setting, position, tank, breech, ahead)
    force = (breech.pressure - ahead.pressure) * setting.area_m2
    resistance = _resistance(setting, position, velocity, breech, ahead)
    behind, before = _swept(setting, position, velocity)
    return [
        -valve,
        -valve_enthalpy + heat[0],
        valve - leak - out,
        valve_enthalpy - leak_enthalpy - out_enthalpy + heat[1] - breech.pressure * behind,
        leak - end,
        leak_enthalpy - end_enthalpy + heat[2] + ahead.pressure * before,
        velocity,
        0.0 if phase.held else (force - resistance) / setting.mass_kg,
        out + end,
        out_enthalpy + end_enthalpy,
        heat[0] + heat[1] + heat[2],
        resistance * velocity,
    ]


def _swept(setting: GunSetting, position: float, velocity: float) -> tuple[float, float]:
    """Volume (m3/s) that the projectile adds behind and takes ahead."""
    behind = before = setting.area_m2 * velocity
    if position > setting.travel_m:
        before *= squeezed(setting.end_m, setting.travel_m + setting.end_m - position)[1]
    if position < 0 and not setting.merged:
        behind *= squeezed(
            setting.breech_volume_m3, setting.breech_volume_m3 + setting.area_m2 * position
        )[1]
    return behind, before


def _valve(setting: GunSetting, time: float, tank: Gas, breech: Gas) -> tuple[float, float]:
    area = (
        0.0
        if setting.merged
        else setting.valve_area_m2 * open_share(setting.valve_way.position(time))
    )
    if area == 0:
        return 0.0, 0.0
    return exchange(tank, breech, iso6358_flow, area, setting.critical_ratio)


def _outlets(
    setting: GunSetting, position: float, breech: Gas, ahead: Gas, sealed: bool
) -> tuple[tuple[float, float], tuple[float, float]]:
    """From breech and column to the surroundings: the projectile's ends uncover the vents and cover
    them."""
    behind = setting.vent_area_m2 * _passed(setting, position)
    before = (
        setting.vent_area_m2 * (1 - _passed(setting, position + setting.length_m))
        + setting.muzzle_area_m2
    )
    column = exchange(ahead, setting.ambient, nozzle_flow, before)
    if sealed or behind == 0:
        return (0.0, 0.0), column
    return exchange(breech, setting.ambient, nozzle_flow, behind), column


def _passed(setting: GunSetting, edge: float) -> float:
    """Share of the vents (0 to 1) that lies behind an edge, smoothly."""
    share = (edge - setting.vent_position_m) / (
        2 * setting.vent_radius_m
    )  # uncovered from their near rim on
    share = min(max(share, 0.0), 1.0)
    return share * share * (3 - 2 * share)


def _heat(
    setting: GunSetting, position: float, tank: Gas, breech: Gas, ahead: Gas
) -> tuple[float, float, float]:
    """Heat (W) from the walls; the film's conductance goes with density."""
    if setting.tank_heat_w_k == 0:
        return 0.0, 0.0, 0.0
    wall, film = setting.ambient.temperature, setting.barrel_heat_w_m_k / STANDARD_DENSITY_KG_M3
    behind = film * max(position, 0.0) * breech.density
    before = film * max(setting.travel_m - position, 0.0) * ahead.density
    return (
        setting.tank_heat_w_k * (wall - tank.temperature),
        behind * (wall - breech.temperature),
        before * (wall - ahead.temperature),
    )


def _resistance(
    setting: GunSetting, position: float, velocity: float, breech: Gas, ahead: Gas
) -> float:
    """Force (N) against the motion."""
    friction = sliding_friction(setting, velocity, breech.pressure - ahead.pressure)
    if setting.column_losses == 0:
        return friction
    behind = column_loss(setting, velocity, breech, position, setting.entrance_loss)
    before = column_loss(
        setting, velocity, ahead, setting.muzzle_m - position - setting.length_m, 0.0
    )
    return friction + behind + before
