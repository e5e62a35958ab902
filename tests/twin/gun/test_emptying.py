"""The tank after the exit: the closed form of a choked outlet, the balances by scipy with a
nozzle's own law, and a valve that shuts."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.array_types import Floats
from pyroshock.signals.valve_profile import ValveProfile
from pyroshock.twin.effects import effect
from pyroshock.twin.gun.bench import GunBench
from pyroshock.twin.gun.shot import ATMOSPHERE_PA, GAS_CONSTANT, ROOM_K, GunEffect
from pyroshock.twin.gun.shots import gun_velocity
from scipy.integrate import solve_ivp

BENCH = GunBench(0.0095, 0.049, 0.048, 0.885, 0.2, 1.4, 1.0)
PRESSURE, MASS = np.array([0.5e5, 2e5, 6e5]), np.array([0.15, 0.5, 1.0])
OUTLET_M2 = 1e-3
GAMMA = 1.4


def after(effects: list[GunEffect], *times_s: float, profile: str = "") -> Floats:
    """(3, m): the tank's pressure at the exit, and at times after it."""
    profiles = [ValveProfile.parse(profile)] * 3 if profile else None
    leads = -np.tile([0.0, *times_s], (3, 1))
    shots = gun_velocity(
        BENCH,
        PRESSURE,
        MASS,
        effects,
        valve_profiles=profiles,
        before_exit_s=leads,
        outlet_area_m2=OUTLET_M2,
    )
    return shots.tank_pressure_pa


def test_into_a_vacuum_it_is_the_closed_form_of_a_choked_outlet() -> None:
    """dp/dt = -gamma A c* sqrt(R T) p / V along the adiabat."""
    times_s = np.array([0.003, 0.01, 0.05])
    at_exit, *later = after([], *times_s).T
    volume = BENCH.tank_volume_m3 + BENCH.projectile_area_m2 * BENCH.travel_m
    choked = np.sqrt(GAMMA) * (2 / (GAMMA + 1)) ** ((GAMMA + 1) / (2 * (GAMMA - 1)))
    warmth = GAS_CONSTANT * ROOM_K * (at_exit / PRESSURE) ** ((GAMMA - 1) / GAMMA)
    rate = OUTLET_M2 * choked * np.sqrt(warmth) / volume
    for time_s, pressure in zip(times_s, later, strict=True):
        wanted = at_exit * (1 + (GAMMA - 1) / 2 * rate * time_s) ** (-2 * GAMMA / (GAMMA - 1))
        # What surrounds a gun in a vacuum is a trace of air of 100 Pa.
        np.testing.assert_allclose(pressure, wanted, rtol=2e-3, atol=100.0)


def nozzle(pressure: float, rt: float, other: float) -> float:
    """kg/(s m2) after de Saint-Venant and Wantzel, from here to a lower pressure."""
    ratio = max(other / pressure, (2 / (GAMMA + 1)) ** (GAMMA / (GAMMA - 1)))
    head = 2 * GAMMA / (GAMMA - 1) * (ratio ** (2 / GAMMA) - ratio ** ((GAMMA + 1) / GAMMA))
    return float(pressure / np.sqrt(rt) * np.sqrt(max(head, 0.0)))


@pytest.mark.parametrize("loss", [10.0, 60.0])
def test_behind_a_valve_it_follows_the_balances_by_scipy(loss: float) -> None:
    valve = effect("gun.valve_flow", loss_coefficient=loss, opening_time_s=1e-4)
    effects = [effect("gun.back_pressure"), valve]
    times_s = (0.004, 0.012)
    measured = after(effects, *times_s) + ATMOSPHERE_PA
    valve_m2 = np.pi / 4 * BENCH.bore_diameter_m**2 / np.sqrt(loss)
    barrel = BENCH.projectile_area_m2 * BENCH.travel_m
    # The barrel's pressure at the exit follows from what the whole gas lost; it hardly matters a
    # little later.
    for row, at_exit in enumerate(measured[:, 0]):
        start_kg = at_exit / (
            GAS_CONSTANT * ROOM_K * (at_exit / (PRESSURE[row] + ATMOSPHERE_PA)) ** (1 - 1 / GAMMA)
        )

        def rates(_: float, y: Floats) -> list[float]:
            tank, behind, tank_kg, behind_kg = y
            tank_rt, behind_rt = tank * BENCH.tank_volume_m3 / tank_kg, behind * barrel / behind_kg
            flow = valve_m2 * nozzle(tank, tank_rt, behind) if tank > behind else 0.0
            out = (
                OUTLET_M2 * nozzle(behind, behind_rt, ATMOSPHERE_PA)
                if behind > ATMOSPHERE_PA
                else 0.0
            )
            into = GAMMA / barrel * (tank_rt * flow - behind_rt * out)
            return [-GAMMA / BENCH.tank_volume_m3 * tank_rt * flow, into, -flow, flow - out]

        start = [at_exit, 0.95 * at_exit, start_kg * BENCH.tank_volume_m3, 0.95 * start_kg * barrel]
        truth = solve_ivp(
            rates, (0, times_s[-1]), start, method="LSODA", t_eval=times_s, rtol=1e-8
        ).y[0]
        gauge = truth - ATMOSPHERE_PA
        np.testing.assert_allclose(
            measured[row, 1:] - ATMOSPHERE_PA, gauge, atol=0.02 * PRESSURE[row]
        )


def test_a_valve_that_shuts_keeps_what_is_in_the_tank() -> None:
    back = [effect("gun.back_pressure")]
    latest_s = float(gun_velocity(BENCH, PRESSURE, MASS, back).exit_time_s.max())
    shutting = f"0:0 0.001:1 {latest_s + 0.005:.4f}:1 {latest_s + 0.006:.4f}:0"
    kept_pa, much_later_pa = after(back, 0.3, 0.5, profile=shutting).T[1:]
    np.testing.assert_allclose(kept_pa, much_later_pa, atol=1e-3 * ATMOSPHERE_PA)
    slowest = int(np.argmax(gun_velocity(BENCH, PRESSURE, MASS, back).exit_time_s))
    open_pa = after(back, 0.3, profile="0:0 0.001:1")[slowest, 1]
    assert abs(open_pa) < 0.01 * PRESSURE[slowest] < 0.1 * PRESSURE[slowest] < kept_pa[slowest]


def test_moments_after_the_exit_need_an_outlet() -> None:
    with pytest.raises(ValueError, match="outlet_area_m2 = None: expected a positive one"):
        gun_velocity(BENCH, PRESSURE, MASS, before_exit_s=np.full((3, 1), -0.01))
