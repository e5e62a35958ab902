"""The tank's pressure after the projectile has left: the gas flows out through the vent holes and
the muzzle.

With V the volume behind the vent holes, n the polytropic index and h = R T times a flow of mass by
ISO 6358 (`chambers`): dp/dt = n / V (h_valve - h_out), dM/dt = mdot_valve - mdot_out there, and in
the tank behind a valve dp/dt = -n h_valve / V, dM/dt = -mdot_valve. Without a valve tank and barrel
are one volume. The outlet is open at once, and what still moves in the barrel is neglected; a valve
goes on to open or to close as its profile says.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit

from ...array_types import Floats
from .chambers import Chamber, TwoChambers, air_kg, choked_flow, critical_ratio
from .motion_kernel import mass_flow, open_share, valve_motion
from .shot import ATMOSPHERE_PA, GAS_CONSTANT, ShotInputs

#: A step's share of the time in which the gas behind the vent holes would leave at sonic speed:
#: near the pressure of the surroundings flows answer thirty times as fast.
_STEP_SHARE = 0.02
#: A loss in the valve of fewer dynamic heads than this throttles next to nothing.
_FEWEST_HEADS = 0.1
#: A volume with less than this share of the gas that it has at the pressure of the surroundings is
#: empty.
_EMPTY = 1e-4


@njit(nogil=True, error_model="numpy", cache=True)
def emptied(  # type: ignore[no-untyped-def]
    states,
    volumes_m3,
    areas_m2,
    index,
    outside_pa,
    outside_rt,
    zero_pa,
    critical,
    valve,
    exit_s,
    after_s,
):
    """(n,) law's pressures of the tank at `after_s` (n,) from the exit on.

    `states` (n, 4): the law's pressure and the mass behind the vent holes, then in the tank;
    `volumes_m3` (n, 2) of both. `areas_m2` (n, 2): of the outlet and of the valve wide open, areas
    of flow times c*; a valve of 0 is none, and all gas is in the first volume. `valve` (n, 2, k):
    moments and positions from the opening on, which is `exit_s` (n,) before the exit. The others
    (n,), SI, as in `motion_kernel.QUANTITIES`.
    """
    n = after_s.size
    pressures = np.empty(n)
    rates, shifted, total = np.empty(4), np.empty(4), np.empty(4)
    for i in range(n):
        state = states[i].copy()
        widest = max(areas_m2[i, 0], areas_m2[i, 1])
        longest = _STEP_SHARE * volumes_m3[i, 0] / (widest * math.sqrt(outside_rt[i]))
        count = max(math.ceil(after_s[i] / longest), 1)
        step = after_s[i] / count
        for number in range(count):
            time = exit_s[i] + number * step
            for c in range(4):
                total[c] = 0.0
            for part in range(4):  # the classical rule of four stages
                ahead = 0.0 if part == 0 else (1.0 if part == 3 else 0.5)
                for c in range(4):
                    shifted[c] = state[c] + ahead * step * rates[c] if part else state[c]
                _rates(
                    shifted, volumes_m3[i], areas_m2[i], index[i], outside_pa[i], outside_rt[i],
                    zero_pa[i], critical,
                    valve[i], time + ahead * step, rates,
                )  # fmt: skip
                for c in range(4):
                    total[c] += rates[c] * (2.0 if 0 < part < 3 else 1.0) / 6
            for c in range(4):
                state[c] += step * total[c]
        pressures[i] = state[2] if areas_m2[i, 1] > 0 else state[0]
    return pressures


@njit(nogil=True, error_model="numpy")
def _rates(  # type: ignore[no-untyped-def]
    state,
    volumes_m3,
    areas_m2,
    index,
    outside_pa,
    outside_rt,
    zero_pa,
    critical,
    valve,
    time,
    rates,
):
    behind = state[0] + zero_pa
    least_kg = _EMPTY * outside_pa * volumes_m3[0] / outside_rt
    behind_rt = behind * volumes_m3[0] / max(state[1], least_kg)
    out = mass_flow(areas_m2[0], behind, behind_rt, outside_pa, outside_rt, critical)
    lost = (behind_rt if out > 0 else outside_rt) * out
    inflow = carried = 0.0
    if areas_m2[1] > 0:
        since, position, rate, _ = valve_motion(valve, time)
        tank = state[2] + zero_pa
        tank_rt = tank * volumes_m3[1] / state[3]
        area = areas_m2[1] * open_share(position + rate * (time - since))[0]
        inflow = mass_flow(area, tank, tank_rt, behind, behind_rt, critical)
        carried = (tank_rt if inflow > 0 else behind_rt) * inflow
        rates[2] = -index / volumes_m3[1] * carried
        rates[3] = -inflow
    else:
        rates[2] = rates[3] = 0.0
    rates[0] = index / volumes_m3[0] * (carried - lost)
    rates[1] = inflow - out


@dataclass(frozen=True, eq=False)
class GasAtExit:
    """The gas of n shots as the projectile leaves: `states` and `volumes_m3` as `emptied` takes
    them, `valve_m2` (n,) the valve's area of flow (0: none), `valve` (n, 2, k) its moments and
    positions."""

    shot: ShotInputs
    states: Floats
    volumes_m3: Floats
    valve_m2: Floats
    valve: Floats

    def tank_pa_after(self, after_s: Floats, exit_s: Floats, outlet_area_m2: float) -> Floats:
        """(n,): the law's pressure of the tank at `after_s` (n,) from the exit on, which is
        `exit_s` (n,) after the opening of the valve, through an outlet of this area of flow."""
        shot = self.shot
        choked = choked_flow(shot.heat_capacity_ratio)
        areas = choked * np.stack([np.full(len(shot), outlet_area_m2), self.valve_m2], axis=1)
        pressures_pa = emptied(
            np.ascontiguousarray(self.states),
            np.ascontiguousarray(self.volumes_m3),
            areas,
            _each(shot, shot.polytropic_index),
            _each(shot, shot.atmosphere_pa),
            _each(shot, GAS_CONSTANT * shot.temperature_k),
            _each(shot, shot.pressure_zero_pa),
            critical_ratio(shot.heat_capacity_ratio),
            np.ascontiguousarray(self.valve),
            _each(shot, exit_s),
            _each(shot, after_s),
        )
        return np.asarray(pressures_pa)


def _each(shot: ShotInputs, values: Floats) -> Floats:
    return np.array(np.broadcast_to(values, (len(shot),)), dtype=np.float64)


def one_gas_at_exit(
    shot: ShotInputs,
    law_pa: Floats,
    mass_kg: Floats | None = None,
    velocity_m_s: Floats | float = 0.0,
) -> GasAtExit:
    """Of shots without a valve's area of flow. Where dynamic heads are lost in a valve at the
    projectile's speed, that is a valve whose area of flow is the bore's over the root of the
    heads."""
    if mass_kg is None:
        mass_kg = air_kg(shot, shot.tank_volume_m3, shot.dead_volume_m3)
    barrel_m3 = shot.dead_volume_m3 + shot.area_m2 * shot.travel_m
    whole_m3 = shot.tank_volume_m3 + barrel_m3
    throttled = shot.valve_air_heads > _FEWEST_HEADS
    heads = np.where(throttled, shot.valve_air_heads, 1.0)
    drop_pa = np.where(throttled, heads * ATMOSPHERE_PA / (GAS_CONSTANT * shot.temperature_k), 0.0)
    drop_pa = drop_pa * np.asarray(velocity_m_s) ** 2 / 2
    tank_pa = law_pa + drop_pa * barrel_m3 / whole_m3
    share = np.where(throttled, barrel_m3 / whole_m3, 1.0)
    tank_kg = np.where(throttled, (1 - share) * mass_kg, 1.0)
    states = np.stack([tank_pa - drop_pa, share * mass_kg, tank_pa, tank_kg], axis=1)
    volumes = np.stack([share * whole_m3, np.where(throttled, shot.tank_volume_m3, 1.0)], axis=1)
    area = np.where(throttled, shot.area_m2 / np.sqrt(heads), 0.0)
    always_open = np.broadcast_to(np.array([[0.0, 1.0], [1.0, 1.0]]), (len(shot), 2, 2))
    return GasAtExit(shot, states, volumes, area, always_open)


def chamber_at_exit(chamber: Chamber, state: Floats) -> GasAtExit:
    """Of shots that were integrated, from their states (4 or 6, n) at the exit."""
    shot = chamber.shot
    if not isinstance(chamber, TwoChambers):
        return one_gas_at_exit(shot, state[2], state[3], state[1])
    volumes = np.stack([chamber.volume_m3 + shot.area_m2 * shot.travel_m, chamber.tank_m3], axis=1)
    return GasAtExit(
        shot,
        np.ascontiguousarray(state[2:].T),
        volumes,
        _each(shot, shot.valve_area_m2),
        chamber.valve,
    )
