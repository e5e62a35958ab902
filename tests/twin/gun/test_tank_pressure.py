"""The tank's pressure before the exit: the closed form, the balances solved by scipy, and a valve's
drop."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.array_types import Floats
from pyroshock.twin.effects import effect
from pyroshock.twin.gun.bench import GunBench
from pyroshock.twin.gun.shot import ATMOSPHERE_PA, GAS_CONSTANT, ROOM_K, GunEffect
from pyroshock.twin.gun.shots import gun_velocity
from scipy.integrate import solve_ivp
from support.records.scalar_gun import scalar_guns

BENCH = GunBench(0.0095, 0.049, 0.048, 0.885, 0.2, 1.4, 1.0)
PRESSURE, MASS = np.array([0.5e5, 2e5, 6e5]), np.array([0.15, 0.5, 1.0])


def before_exit(share: float) -> Floats:
    """Moments (3, 1): this share of the nominal transit before the exit."""
    return share * gun_velocity(BENCH, PRESSURE, MASS).exit_time_s[:, None]


def pressures(effects: list[GunEffect], leads_s: Floats, coarser: float = 1.0) -> Floats:
    return gun_velocity(
        BENCH, PRESSURE, MASS, effects, coarser, before_exit_s=leads_s
    ).tank_pressure_pa


def test_a_nominal_tank_follows_the_adiabat_and_stands_still_before_the_shot() -> None:
    swept = BENCH.projectile_area_m2 * BENCH.travel_m
    adiabat = PRESSURE * (BENCH.tank_volume_m3 / (BENCH.tank_volume_m3 + swept)) ** 1.4
    leads = np.hstack([before_exit(0.0), before_exit(1.0), before_exit(3.0)])
    at_exit, at_start, before = pressures([], leads).T
    np.testing.assert_allclose(at_exit, adiabat, rtol=1e-12)
    np.testing.assert_allclose(at_start, PRESSURE, rtol=1e-6)
    np.testing.assert_allclose(before, PRESSURE, rtol=1e-12)


@pytest.mark.parametrize(
    "next_to_nothing",
    [
        effect("gun.blow_by", discharge_coefficient=1e-9),
        effect("gun.valve_flow", loss_coefficient=1e-5, opening_time_s=0.0),
    ],
    ids=lambda each: each.id,
)
def test_integrated_shots_have_the_pressures_of_the_closed_form(next_to_nothing: GunEffect) -> None:
    leads = np.hstack([before_exit(share) for share in (0.0, 0.05, 0.3, 0.5, 0.8)])
    np.testing.assert_allclose(pressures([next_to_nothing], leads), pressures([], leads), rtol=2e-4)


@pytest.mark.parametrize(
    "acting",
    [
        [effect("gun.blow_by", discharge_coefficient=0.5)],
        [effect("gun.blow_by", discharge_coefficient=0.5), effect("gun.back_pressure")],
        [effect("gun.dead_volume", volume_m3=5e-4), effect("gun.heat_exchange", share=0.3)],
        [
            effect("gun.valve_flow", loss_coefficient=50.0, opening_time_s=0.05),
            effect("gun.back_pressure"),
        ],
        [effect("gun.barrel_loss"), effect("gun.sliding_friction"), effect("gun.back_pressure")],
        # A wide leak into a vacuum beside a narrow valve that opens slowly.
        [
            effect("gun.valve_flow", loss_coefficient=320.0, opening_time_s=0.4),
            effect("gun.blow_by", discharge_coefficient=0.5, wear_m=5e-4),
        ],
    ],
    ids=lambda each: "+".join(one.id for one in each),
)
def test_pressures_are_those_of_the_balances_as_scipy_solves_them(acting: list[GunEffect]) -> None:
    """Also at the accuracy of a diagnosis, within a twentieth of its tolerance."""
    leads = np.hstack([before_exit(share) for share in (0.02, 0.5)])
    fine, coarse = pressures(acting, leads), pressures(acting, leads, 30.0)
    np.testing.assert_allclose(coarse, fine, atol=2.5e-4 * PRESSURE[:, None].max())
    for row, gun in enumerate(scalar_guns(BENCH, PRESSURE, MASS, acting)):
        assert gun.velocity("Radau", 1e-9) > 0
        solved = solve_ivp(
            gun.rates,
            (0.0, gun.exit_s),
            gun.start(),
            "Radau",
            dense_output=True,
            rtol=1e-9,
            atol=1e-9,
        )
        tank = 4 if gun.loss > 0 else 2
        wanted = [solved.sol(gun.exit_s - lead)[tank] - gun.atmosphere for lead in leads[row]]
        np.testing.assert_allclose(fine[row], wanted, rtol=2e-5)


def test_a_drop_that_goes_with_the_speed_keeps_the_tank_above_the_gas_behind_the_projectile() -> (
    None
):
    """As much as keeps the mass of all gas: the drop times the barrel's share of the volume."""
    heads = 60.0
    valve = effect(
        "gun.valve_flow", loss_coefficient=0.0, opening_time_s=0.0, steady_loss_coefficient=heads
    )
    bore = effect("gun.barrel_loss", friction_factor=0.0, drag_coefficient=heads, gas_heads=0.0)
    shots = gun_velocity(BENCH, PRESSURE, MASS, [valve], before_exit_s=before_exit(0.0))
    np.testing.assert_allclose(
        shots.velocity_m_s, gun_velocity(BENCH, PRESSURE, MASS, [bore]).velocity_m_s, rtol=1e-6
    )
    drop_pa = heads * ATMOSPHERE_PA / (GAS_CONSTANT * ROOM_K) * shots.velocity_m_s**2 / 2
    swept = BENCH.projectile_area_m2 * BENCH.travel_m
    kept_back_pa = drop_pa * swept / (BENCH.tank_volume_m3 + swept)
    alike = pressures([bore], before_exit(0.0))[:, 0]
    np.testing.assert_allclose(shots.tank_pressure_pa[:, 0] - alike, kept_back_pa, rtol=1e-5)


def test_moments_of_another_shape_are_refused_and_a_shot_that_stays_has_no_pressure() -> None:
    with pytest.raises(
        ValueError, match=r"before_exit_s has shape \(2, 1\): expected \(n, m\) for 3 shots"
    ):
        gun_velocity(BENCH, PRESSURE, MASS, before_exit_s=np.zeros((2, 1)))
    stuck = gun_velocity(BENCH, [10.0, 2e5], 5.0, before_exit_s=np.zeros((2, 1)))
    assert np.isnan(stuck.tank_pressure_pa[0, 0])
    assert np.isfinite(stuck.tank_pressure_pa[1, 0])
