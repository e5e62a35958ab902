"""Energy and mass of the gas, the projectile and what has gone: nothing is lost on the way, with a
leak and a valve.

The product's own rates, integrated by scipy beside the two flows that leave the books: work against
resistance, and what the leak carries away.
"""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.twin.gun.bench import GunBench
from pyroshock.twin.gun.chambers import Chamber, TwoChambers
from pyroshock.twin.gun.effects.back_pressure import BackPressure
from pyroshock.twin.gun.effects.barrel_loss import BarrelLoss
from pyroshock.twin.gun.effects.blow_by import BlowBy
from pyroshock.twin.gun.effects.sliding_friction import SlidingFriction
from pyroshock.twin.gun.effects.valve_flow import ValveFlow
from pyroshock.twin.gun.shot import GAS_CONSTANT, nominal_shot
from scipy.integrate import solve_ivp

BENCH = GunBench(9.5e-3, 0.049, 0.048, 0.885, 0.3, 1.4, 1.0)
#: The law's pressure is absolute with the atmosphere ahead: only then is p V the gas's energy.
LOSSES = [BackPressure(), BlowBy(), BarrelLoss(), SlidingFriction()]


def books(kind, effects, bar, mass_kg):
    """State before and after 30 ms, with work against resistance (J), mass leaked (kg), enthalpy
    leaked (J)."""
    shot = nominal_shot(BENCH, np.array([bar * 1e5]), np.array([mass_kg]))
    for effect in effects:
        shot = effect.prepare(shot)
    chamber = kind(shot, [])
    start = chamber.start()
    area, bore = BENCH.projectile_area_m2, BENCH.bore_diameter_m
    outside = float(shot.atmosphere_pa[0]) / (GAS_CONSTANT * float(shot.temperature_k[0]))

    def rates(time, state):
        column = state[:-3, None]
        instant = chamber.instant(np.array([time]), column)
        moved = chamber.rates(np.array([time]), column)[:, 0]
        leak = -moved[3::2].sum()  # what one gas loses to the other is still there
        heads = 0.02 * instant.position_m / bore * instant.gas_density_kg_m3 + 1.0 * outside
        resisting = chamber.drag_n + area * heads * instant.velocity_m_s**2 / 2
        warmth = instant.gas_temperature_k if leak > 0 else shot.temperature_k
        carried = 1.4 / 0.4 * GAS_CONSTANT * warmth * leak
        gone = [float((resisting * column[1])[0]), float(leak), float(carried[0])]
        return np.concatenate([moved, gone])

    # every projectile here moves from the first instant on: friction that holds would take work
    # from nothing
    run = solve_ivp(
        rates, (0, 0.03), [*start[:, 0], 0.0, 0.0, 0.0], "LSODA", rtol=1e-10, atol=1e-10
    )
    assert run.success
    return chamber, start[:, 0], run.y[:-3, -1], run.y[-3:, -1]


def energy(chamber, state, mass_kg):
    """Of motion, of the gas behind the projectile, and of that in the tank, J."""
    volume = float(chamber.volume_m3[0]) + BENCH.projectile_area_m2 * state[0]
    gas = state[2] * volume / 0.4
    tank = state[4] * float(chamber.tank_m3[0]) / 0.4 if len(state) > 4 else 0.0
    return mass_kg * state[1] ** 2 / 2 + gas + tank


@pytest.mark.parametrize(("bar", "mass_kg"), [(1.0, 0.2), (4.0, 0.5), (8.0, 1.0)])
@pytest.mark.parametrize(
    ("kind", "effects"),
    [(Chamber, LOSSES), (TwoChambers, [*LOSSES, ValveFlow(opening_time_s=0.01)])],
    ids=["leak", "leak and valve"],
)
def test_nothing_is_lost(kind, effects, bar, mass_kg):
    """What moves the projectile is less than what the gas gives up: no efficiency is above one."""
    chamber, start, end, (work, leaked, carried) = books(kind, effects, bar, mass_kg)
    assert end[1] > 0.1  # it moves
    assert leaked > 0 and work > 0 and carried > 0
    before, after = energy(chamber, start, mass_kg), energy(chamber, end, mass_kg)
    assert after + work + carried == pytest.approx(before, rel=1e-6)
    masses = slice(3, None, 2)
    assert end[masses].sum() + leaked == pytest.approx(start[masses].sum(), rel=1e-8)
    moving = mass_kg * end[1] ** 2 / 2
    assert 0 < moving < before - (after - moving)
