"""A leak beside the atmosphere: balances of mass and energy by `solve_ivp`, and no flow against the pressure."""

from __future__ import annotations

import math

import numpy as np
import pytest
from pyroshock.twin.effects import effect
from pyroshock.twin.gun.bench import GunBench
from pyroshock.twin.gun.shots import gun_velocity

BENCH = GunBench(0.0095, 0.049, 0.048, 0.885, 0.2, 1.4, 1.0)
AIR_PA, ROOM_K, GAS, GAMMA = 101_325.0, 293.15, 287.05, 1.4
AREA_M2, BORE_M2 = math.pi * 0.048**2 / 4, math.pi * 0.049**2 / 4
CHOKED = math.sqrt(GAMMA) * (2 / (GAMMA + 1)) ** ((GAMMA + 1) / (2 * (GAMMA - 1)))
#: Gauge, from what hardly moves the bullet.
PRESSURES = np.array([0.05, 0.1, 0.15, 0.2, 0.3, 0.5, 1.0, 3.0]) * 1e5


def balanced_velocity(gauge_pa: float, mass_kg: float, ahead_pa: float, discharge: float) -> float:
    """Mass and internal energy of absolute gas behind the bullet; a choked leak of what is above the surroundings.

    Without atmosphere ahead (`ahead_pa` 0) the law of eq. 2.16 pushes with the gauge pressure alone.
    """
    from scipy.integrate import solve_ivp

    leak_m2, friction_n = discharge * (BORE_M2 - AREA_M2) * CHOKED, 0.2 * 9.80665 * mass_kg
    start_pa = gauge_pa + ahead_pa

    def rates(_, state):
        position, velocity, gas_kg, law_pa = state
        volume = BENCH.tank_volume_m3 + AREA_M2 * position
        absolute = law_pa + AIR_PA - ahead_pa
        warmth = absolute * volume / gas_kg  # R T
        above = absolute - AIR_PA
        leak = leak_m2 * above / math.sqrt(warmth) if above > 0 else 0.0
        force = (law_pa - ahead_pa) * AREA_M2 - friction_n
        law_rate = GAMMA / volume * (-warmth * leak - law_pa * AREA_M2 * velocity)
        return [velocity, force / mass_kg, -leak, law_rate]

    def at_vents(_, state):
        return state[0] - BENCH.travel_m

    def at_rest(_, state):
        return state[1]

    at_vents.terminal = at_rest.terminal = True  # type: ignore[attr-defined]
    at_rest.direction = -1.0  # type: ignore[attr-defined]
    if gauge_pa * AREA_M2 <= friction_n:
        return 0.0  # the pressure only falls: what does not start now never does
    gas_kg = (gauge_pa + AIR_PA) * BENCH.tank_volume_m3 / (GAS * ROOM_K)
    end = solve_ivp(
        rates, (0.0, 5.0), [0.0, 0.0, gas_kg, start_pa], "DOP853", events=(at_vents, at_rest), rtol=1e-9,
        atol=[1e-10, 1e-9, 1e-12, 1e-5],
    )  # fmt: skip
    return float(end.y[1, -1]) if end.t_events[0].size else 0.0


@pytest.mark.parametrize("mass_kg", [0.1428, 1.0])
@pytest.mark.parametrize("ahead_pa", [0.0, AIR_PA])
def test_gauge_leak_follows_the_balances_at_every_pressure(ahead_pa, mass_kg):
    effects = [
        effect("gun.blow_by", discharge_coefficient=0.0, gauge_discharge_coefficient=0.6),
        effect("gun.back_pressure", atmosphere_pa=ahead_pa),
    ]
    velocity = gun_velocity(BENCH, PRESSURES, mass_kg, effects).velocity_m_s
    expected = [balanced_velocity(pressure, mass_kg, ahead_pa, 0.6) for pressure in PRESSURES]
    np.testing.assert_allclose(velocity, expected, rtol=1e-5)
    assert np.all(np.diff(velocity[velocity > 0]) > 0) and velocity[-1] > 10


def test_tank_at_the_surroundings_pressure_does_not_leak():
    """With the atmosphere the law counts from vacuum: a leak of that pressure would let air out of an open tank.

    A gas of no more than the surroundings' pressure pushes a bullet without friction as if there were no leak.
    """
    free = GunBench(0.0095, 0.049, 0.048, 0.885, 0.0, 1.4, 1.0)
    ahead = effect("gun.back_pressure")
    leak = effect("gun.blow_by", discharge_coefficient=0.0, gauge_discharge_coefficient=1e-3)
    little = np.array([0.02e5, 0.1e5, 0.4e5])
    tight, leaking = (gun_velocity(free, little, 0.2, effects).velocity_m_s for effects in ([ahead], [ahead, leak]))
    np.testing.assert_allclose(leaking, tight, rtol=5e-3)
