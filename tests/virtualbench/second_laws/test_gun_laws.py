"""The gun's second laws against limits and closed forms."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from pyroshock.virtualbench.effects import Effects
from pyroshock.virtualbench.gun.build import GunBuild, Projectile
from pyroshock.virtualbench.gun.integrate import muzzle_velocity
from pyroshock.virtualbench.second_laws import LAWS, SPLITS
from pyroshock.virtualbench.second_laws import gun as law
from pyroshock.virtualbench.second_laws.gun import muzzle_velocity_m_s

GUN = replace(GunBuild(), friction_coefficient=0.0)
BULLET = Projectile(0.2)
PRESSURE = 1e5
EFFECTS = sorted(
    effect for effect, split in LAWS if effect.startswith("gun.") and split == "sealed"
)


def shot(
    strengths: dict[str, float],
    split: str = "development",
    projectile: Projectile = BULLET,
    pa: float = PRESSURE,
) -> float:
    return muzzle_velocity_m_s(GUN, strengths, split, pa, projectile)


def expanded(index: float, opposing: float = 0.0, mass: float = BULLET.mass_kg) -> float:
    """Velocity of a frictionless piston that gas of the tank drives to the vents, by work."""
    start, swept = GUN.tank_volume_m3, BULLET.area_m2 * GUN.vent_position_m
    pressure, ratio = PRESSURE + opposing, (start + swept) / start
    work = math.log(ratio) if index == 1 else (1 - ratio ** (1 - index)) / (index - 1)
    return math.sqrt(2 / mass * (pressure * start * work - opposing * swept))


@pytest.mark.parametrize("split", SPLITS)
def test_without_effects_it_is_the_ideal_bench_and_with_atmosphere_or_dead_volume_the_closed_form(
    split: str,
) -> None:
    assert shot({}) == pytest.approx(expanded(1.4), rel=1e-5)
    build = GunBuild()
    own = muzzle_velocity(build, Effects.none(), PRESSURE, BULLET, np.random.default_rng(0))
    assert muzzle_velocity_m_s(build, {}, split, PRESSURE, BULLET) == pytest.approx(own, rel=1e-5)
    # A column in front weighs little then, and a shock is weak.
    heavy = Projectile(50.0)
    wanted = expanded(1.4, GUN.atmosphere_pa, 50.0)
    assert shot({"gun.back_pressure": 1.0}, split, heavy) == pytest.approx(wanted, rel=0.01)
    # A volume whose walls are cold, or behind a hole, takes about what filling it at once does.
    volume = 4 * GUN.dead_volume_m3
    lower = PRESSURE * GUN.tank_volume_m3 / (GUN.tank_volume_m3 + volume)
    at_once = math.sqrt(lower / PRESSURE)
    assert shot({"gun.dead_volume": 4.0}, split) / shot({}) == pytest.approx(at_once, abs=0.03)


@pytest.mark.parametrize("split", SPLITS)
@pytest.mark.parametrize("effect", EFFECTS)
def test_strength_next_to_zero_does_nothing(effect: str, split: str) -> None:
    assert shot({effect: 1e-7}, split) == pytest.approx(shot({}), rel=1e-5)


@pytest.mark.parametrize("split", SPLITS)
@pytest.mark.parametrize("effect", [name for name in EFFECTS if name != "gun.heat_exchange"])
def test_losses_slow_the_shot(effect: str, split: str) -> None:
    assert shot({effect: 1.0}, split) < shot({}) * (1 - 1e-4)


def test_fast_relaxation_is_isothermal_and_a_step_backwards_meets_no_vacuum() -> None:
    assert shot({"gun.heat_exchange": 3e4}, "sealed") == pytest.approx(expanded(1.0), rel=1e-3)
    # An integrator tries such steps where the atmosphere nearly stops a shot.
    acting = {"gun.back_pressure": 1.0, "gun.blow_by": 0.4, "gun.valve_flow": 0.4}
    figures = law.shot_figures(GUN, acting, "development", BULLET)
    exhausted, backwards = [3e-3, 600.0, 6e-4, -211.0, 0.0, 0.0], [-0.47, -597.0]
    assert np.isfinite(law.rates(0.3, np.array(exhausted + backwards), figures)).all()


def test_shock_and_valve_have_their_limits() -> None:
    assert law.shock_pressure(1e5, 1e-4) / 1e5 - 1 == pytest.approx(1.4e-4, rel=1e-3)
    assert law.shock_pressure(1e5, 100.0) / 1e5 == pytest.approx(1.4 * 2.4 / 2 * 100**2, rel=0.01)
    # Rankine and Hugoniot: density from the pressures' ratio, and the piston's speed from both.
    mach, gamma = 0.7, 1.4
    ratio = law.shock_pressure(1.0, mach)
    front = math.sqrt(1 + (gamma + 1) / (2 * gamma) * (ratio - 1))
    density = (gamma + 1) * front**2 / ((gamma - 1) * front**2 + 2)
    assert front * (1 - 1 / density) == pytest.approx(mach)
    pressure, density = 2e5, 2.4
    flow = law.control_valve(pressure, density, 0.98)
    assert flow == pytest.approx(math.sqrt(2 * density * 0.02 * pressure), rel=0.05)
    pressure, density, drop = 2e5, 2.4, law.VALVE_CHOKED_DROP
    wanted = 2 / 3 * math.sqrt(2 * density * drop * pressure)
    assert law.control_valve(pressure, density, 0.1) == pytest.approx(wanted, rel=2e-3)
    assert law.control_valve(pressure, density, 0.3) == law.control_valve(pressure, density, 0.1)


def test_orifice_nozzle_and_rough_wall_have_their_figures() -> None:
    """As Perry measured; choked below the critical ratio; and Moody's chart at a relative roughness
    of a thousandth, fully rough: von Karman's 0.0196."""
    assert law.perry_coefficient(0.0) == pytest.approx(0.84, abs=0.005)
    assert law.perry_coefficient(1.0) == pytest.approx(0.60, abs=0.005)
    choked = law.nozzle(2e5, 293.0, 0.1)
    assert law.nozzle(2e5, 293.0, 0.5) == choked
    assert law.nozzle(2e5, 293.0, 0.52829) == pytest.approx(choked, rel=1e-6)
    assert law.nozzle(2e5, 293.0, 1.0) == 0.0
    assert law.rough_factor(law.ROUGHNESS_M * 1000) == pytest.approx(0.0196, abs=2e-4)


@pytest.mark.parametrize("friction", [0.1, 1.0, 10.0])
def test_isothermal_flow_is_choked_where_it_is_largest(friction: float) -> None:
    def squared(r: float) -> float:
        return (1 - r * r) / (friction - 2 * math.log(r))

    best = law.choked_ratio(friction)
    assert squared(best) > max(squared(best * 1.02), squared(best * 0.98))


def test_laminar_leak_goes_with_the_cube_of_the_clearance() -> None:
    """And so differs by bullet more than the other law's."""
    masses = (0.1, 0.2, 0.5)
    figures = [
        law.shot_figures(GUN, {"gun.blow_by": 1.0}, "sealed", Projectile(mass)) for mass in masses
    ]
    from pyroshock.virtualbench.second_laws.owners import bullet_factor

    cubes = [bullet_factor(mass) ** 3 for mass in masses]
    np.testing.assert_allclose(
        [f[law.LAMINAR] / figures[0][law.LAMINAR] for f in figures], np.divide(cubes, cubes[0])
    )
