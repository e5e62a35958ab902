"""The gun's second laws for calibration against closed forms and books' limits."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from pyroshock.virtualbench.gun.build import GunBuild, Projectile
from pyroshock.virtualbench.gun.gas import CHOKED, CV, GAMMA, GAS_CONSTANT
from pyroshock.virtualbench.gun.motion import AIR_VISCOSITY_PA_S
from pyroshock.virtualbench.second_laws import gun as law
from pyroshock.virtualbench.second_laws import gun_calibration as flow
from pyroshock.virtualbench.second_laws.blow_down import ValveClosing, follow_shot
from pyroshock.virtualbench.second_laws.gun import muzzle_velocity_m_s, shot_figures

GUN = replace(GunBuild(), friction_coefficient=0.0)
BULLET = Projectile(0.2)
SPLIT = "calibration"


def test_split_without_laws_is_told() -> None:
    with pytest.raises(
        ValueError, match="'tuning': expected one of development, calibration, sealed"
    ):
        muzzle_velocity_m_s(GUN, {}, "tuning", 1e5, BULLET)


def test_flow_is_the_ellipse_of_iso_6358() -> None:
    pressure, critical = 3e5, flow.POPPET_RATIO
    choked = CHOKED * pressure / math.sqrt(GAS_CONSTANT * 293.0)
    assert flow.sonic_flow(pressure, 293.0, 0.1, critical) == pytest.approx(choked)
    assert flow.sonic_flow(pressure, 293.0, critical, critical) == pytest.approx(choked)
    middle = (1 + critical) / 2
    assert flow.sonic_flow(pressure, 293.0, middle, critical) == pytest.approx(
        choked * math.sqrt(0.75)
    )
    assert flow.sonic_flow(pressure, 293.0, 1.0, critical) == 0.0


def test_poppet_opens_sooner_under_more_pressure() -> None:
    """Constant acceleration, as the pressure: the times to the end go as its inverse root."""
    lifts = [flow.poppet_lift(0.1, pressure, 0.5) for pressure in (1e5, 4e5)]
    assert lifts[1] == pytest.approx(4 * lifts[0])
    assert flow.poppet_lift(0.5, flow.THROWN_PA, 0.5) == pytest.approx(1.0)
    assert flow.poppet_lift(0.25, 4 * flow.THROWN_PA, 0.5) == pytest.approx(1.0)
    assert flow.poppet_lift(2.0, 1e5, 0.5) == 1.0


def test_smooth_wall_is_moodys_chart() -> None:
    """f = 0.0178 at Re = 1e5 (White, Fluid Mechanics, table of smooth pipes: 0.0180), and F ~
    v^1.75 rho^0.75."""
    bore, density = 0.05, 2.4
    speed = 1e5 * AIR_VISCOSITY_PA_S / (density * bore)
    drop = flow.smooth_drop_pa(density, speed, bore, bore)
    assert drop / (density * speed**2 / 2) == pytest.approx(0.0180, abs=3e-4)
    assert flow.smooth_drop_pa(density, -2 * speed, bore, bore) == pytest.approx(-(2**1.75) * drop)
    assert flow.smooth_drop_pa(3 * density, speed, bore, bore) == pytest.approx(3**0.75 * drop)


def test_lip_rubs_with_two_thirds_of_its_load_and_lets_through_the_square_of_pressure() -> None:
    assert flow.lip_friction_n(0.0) == flow.LIP_FRICTION_N
    loads = np.array([7.0, 63.0]) * flow.SQUEEZE_PA
    assert flow.lip_friction_n(loads[1]) / flow.lip_friction_n(loads[0]) == pytest.approx(
        8 ** (2 / 3)
    )
    figures = shot_figures(GUN, {"gun.blow_by": 1.0}, SPLIT, BULLET)
    flows = [law._leak((pressure, 293.0, 1.0), 1.0, figures) for pressure in (1e5, 3e5)]
    assert flows[1] / flows[0] == pytest.approx(9.0, rel=1e-4)
    assert law._leak((1e5, 293.0, 1.0), 1e5, figures) == 0.0


def test_film_of_natural_convection_is_the_books() -> None:
    """h = 1.31 dT^(1/3) W/(m2 K) at vertical plates in air of 1 atm, and 1.52 at horizontal ones
    (Holman, ch. 7)."""
    density = 101_325 / (GAS_CONSTANT * 300.0)
    films = [flow.natural_film_w_m2_k(density, 300.0, 300.0 + step) for step in (1.0, 8.0)]
    assert films[0] == pytest.approx(1.52, rel=0.05)
    assert films[1] == pytest.approx(2 * films[0])
    assert flow.natural_film_w_m2_k(8 * density, 300.0, 301.0) == pytest.approx(4 * films[0])


def test_much_convection_keeps_the_gas_at_the_wires_temperature() -> None:
    """Work of an isothermal expansion into a vacuum."""
    start, swept = GUN.tank_volume_m3, BULLET.area_m2 * GUN.vent_position_m
    wanted = math.sqrt(2 / BULLET.mass_kg * 1e5 * start * math.log((start + swept) / start))
    assert muzzle_velocity_m_s(
        GUN, {"gun.heat_exchange": 1e5}, SPLIT, 1e5, BULLET
    ) == pytest.approx(wanted, rel=2e-3)


def test_hose_holds_the_energy_that_the_gas_has_lost() -> None:
    """Gas p V / (gamma - 1) and hose, the integral of (p) dV from the ambient pressure on."""
    volume, growth, ambient, pressure = 1e-3, 4e-9, 1e5, 3.3e5
    energy = (
        pressure * (volume + growth * (pressure - ambient)) / (GAMMA - 1)
        + growth * (pressure**2 - ambient**2) / 2
    )
    assert flow.hose_pressure_pa(energy, volume, growth, ambient) == pytest.approx(
        pressure, rel=1e-12
    )
    assert flow.hose_pressure_pa(energy, volume, 1e-25, ambient) == pytest.approx(
        (GAMMA - 1) * energy / volume
    )


@pytest.mark.parametrize("valve", [0.0, 0.6])
def test_tank_with_a_hose_is_shut_off_without_a_jump(valve: float) -> None:
    acting = {"gun.back_pressure": 1.0, "gun.dead_volume": 4.0, "gun.valve_flow": valve}
    exit_s = follow_shot(GUN, acting, SPLIT, 2e5, BULLET, until_s=0.0).exit_s
    closing = ValveClosing(exit_s + 0.01, 0.01)
    shot = follow_shot(GUN, acting, SPLIT, 2e5, BULLET, until_s=exit_s + 0.3, closing=closing)
    assert np.abs(np.diff(shot.tank_pressure_pa)).max() < 0.02 * 2e5
    late = shot.tank_pressure_pa[shot.time_s > closing.at_s + 0.011]
    np.testing.assert_allclose(late, late[0], rtol=1e-6)
    assert late[0] > 1e4


def test_air_ahead_that_cannot_leave_is_compressed_by_its_isentrope() -> None:
    figures = shot_figures(GUN, {"gun.back_pressure": 1.0}, SPLIT, BULLET)
    assert figures[law.ORIFICE_M2] == pytest.approx(flow.FREE_MUZZLE * BULLET.area_m2)
    figures[law.ORIFICE_M2] = 1e-12
    room, ambient, wall = figures[law.CAVITY_M3], figures[law.AMBIENT], figures[law.WALL_K]
    tank = 5e5 * figures[law.TANK_M3] / (GAS_CONSTANT * wall)
    mass = ambient * room / (GAS_CONSTANT * wall)
    state = np.array([tank, tank * CV * wall, 0.0, 0.0, mass, mass * CV * wall, 0.0, 0.0])
    _, rows = law.integrated(law.rates, state, 0.0, 0.03, figures)
    free = 1 - rows[:, 6] / figures[law.TRAVEL]
    assert free[-1] < 0.7
    held = free > flow.LEAST_ROOM
    pressure = (GAMMA - 1) * rows[held, 5] / (room * free[held])
    np.testing.assert_allclose(pressure, ambient * free[held] ** -GAMMA, rtol=1e-4)
    np.testing.assert_allclose(rows[:, 4], mass, rtol=1e-6)
