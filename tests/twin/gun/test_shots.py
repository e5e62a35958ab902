"""The gun with effects: against scipy, its limits, and balances of energy and mass."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pyroshock.twin.effects import catalogue, effect
from pyroshock.twin.gun.nominal import muzzle_velocity, trajectory
from pyroshock.twin.gun.shots import Status, gun_velocity
from support.records.scalar_gun import THESIS_GUN, WITHIN, scalar_guns

GUN = [kind for identity, kind in catalogue().items() if identity.startswith("gun.")]
IDS = [kind.id for kind in GUN]
PRESSURE = np.array([0.6e5, 1.7e5, 4e5, 7e5])
MASS = np.array([0.15, 1.5, 0.4, 0.9])
ABSOLUTE = effect("gun.back_pressure")
#: Wide and sudden, but not nothing.
WIDE = effect("gun.valve_flow", loss_coefficient=1e-3, opening_time_s=0.0)


def by_scipy(pressure, mass, effects, method="LSODA", rtol=1e-10):
    return np.array(
        [gun.velocity(method, rtol) for gun in scalar_guns(THESIS_GUN, pressure, mass, effects)]
    )


def velocity(*effects, bench=THESIS_GUN):
    return gun_velocity(bench, PRESSURE, MASS, effects).velocity_m_s


@pytest.mark.parametrize("kind", GUN, ids=IDS)
def test_an_effect_off_leaves_shots_nominal_and_is_scipys_elsewhere_for_each_travel(kind):
    on = {item.name: item.default for item in kind.parameters()}
    off = {item.name: item.off for item in kind.parameters()}
    np.testing.assert_allclose(
        velocity(kind(**off)), muzzle_velocity(THESIS_GUN, PRESSURE, MASS), rtol=1e-13
    )
    acting = velocity(kind(**on))
    np.testing.assert_allclose(acting, by_scipy(PRESSURE, MASS, [kind()]), rtol=1e-6)
    mixed = kind(**{name: np.array([off[name], on[name], off[name], on[name]]) for name in on})
    # Integrated steps hang on rounding.
    np.testing.assert_allclose(
        velocity(mixed), np.where([True, False, True, False], velocity(), acting), rtol=1e-6
    )
    travel = np.array([0.5, 0.7, 0.885, 1.2])
    exit_velocity = gun_velocity(THESIS_GUN, PRESSURE, MASS, [kind()], travel_m=travel).velocity_m_s
    alone = [
        gun_velocity(replace(THESIS_GUN, travel_m=float(t)), p, m, [kind()]).velocity_m_s[0]
        for t, p, m in zip(travel, PRESSURE, MASS, strict=True)
    ]
    assert exit_velocity == pytest.approx(alone, rel=1e-5)


def mixture(rng):
    kinds = rng.choice(np.array(GUN, dtype=object), size=rng.integers(2, 6), replace=False)
    return [
        kind(**{p.name: rng.uniform(*WITHIN[p.name], 3) for p in kind.parameters()})
        for kind in kinds
    ]


@pytest.mark.parametrize("seed", range(8))
def test_mixtures_are_as_scipy_has_them(seed):
    rng = np.random.default_rng(seed)
    shots = (rng.uniform(2e5, 10e5, 3), rng.uniform(0.1, 1.5, 3))
    effects = mixture(rng)
    expected = by_scipy(*shots, effects, "DOP853", 1e-9)
    np.testing.assert_allclose(
        gun_velocity(THESIS_GUN, *shots, effects).velocity_m_s, expected, rtol=1e-6
    )


def test_a_wide_valve_is_none_a_leak_goes_with_its_area_and_the_order_of_effects_does_not_matter():
    """A valve lets the dead volume fill to the pressure of the closed form."""
    np.testing.assert_allclose(velocity(WIDE), velocity(), rtol=2e-3)
    dead = effect("gun.dead_volume", volume_m3=1e-3)
    np.testing.assert_allclose(velocity(WIDE, dead, ABSOLUTE), velocity(dead, ABSOLUTE), rtol=2e-3)
    lost = [
        1 - velocity(effect("gun.blow_by", discharge_coefficient=c)) / velocity()
        for c in (1e-2, 1e-3)
    ]
    np.testing.assert_allclose(lost[0] / lost[1], 10, rtol=0.02)
    effects = [kind() for kind in GUN]
    np.testing.assert_allclose(velocity(*effects), velocity(*effects[::-1]), rtol=1e-9)


def test_work_and_time_in_the_barrel_are_the_closed_forms():
    """Heat for an isothermal expansion gives the logarithm; an endless tank pushes with the gauge
    pressure against the atmosphere; absolute pressure does the work of the absolute gas less that
    of the atmosphere."""
    free = replace(THESIS_GUN, friction_coefficient=0.0)
    swept = THESIS_GUN.projectile_area_m2 * THESIS_GUN.travel_m
    work = PRESSURE * free.tank_volume_m3 * np.log1p(swept / free.tank_volume_m3)
    isothermal = velocity(effect("gun.heat_exchange", share=1.0), bench=free)
    np.testing.assert_allclose(isothermal, np.sqrt(2 * work / MASS), rtol=1e-12)
    endless = velocity(ABSOLUTE, bench=replace(free, tank_volume_m3=1e6))
    np.testing.assert_allclose(endless, np.sqrt(2 * PRESSURE * swept / MASS), rtol=1e-8)
    tank_m3, air = THESIS_GUN.tank_volume_m3, 101_325.0
    gas = (PRESSURE + air) * tank_m3 / 0.4 * (1 - (1 + swept / tank_m3) ** -0.4)
    energy = gas - air * swept - THESIS_GUN.friction_work_j(MASS)
    np.testing.assert_allclose(velocity(ABSOLUTE), np.sqrt(2 * energy / MASS), rtol=1e-12)
    times = [trajectory(THESIS_GUN, q, m).exit_time_s for q, m in zip(PRESSURE, MASS, strict=True)]
    np.testing.assert_allclose(
        gun_velocity(THESIS_GUN, PRESSURE, MASS).exit_time_s, times, rtol=1e-8
    )


@pytest.mark.parametrize(
    "effects",
    [
        (),
        (effect("gun.blow_by"),),
        (effect("gun.valve_flow", loss_coefficient=100.0),),
        (effect("gun.valve_flow"),),
    ],
    ids=["closed", "one gas", "two gases", "two gases of the default"],
)
def test_shots_that_do_not_leave_say_where_they_are_and_an_empty_tank_fires_nothing(effects):
    bench = replace(THESIS_GUN, friction_coefficient=1.0, tank_volume_m3=2e-4)
    shots = gun_velocity(bench, [10.0, 3e4, 9e5], [0.5, 5.0, 0.5], effects)
    assert list(shots.status) == [Status.NOT_STARTED, Status.STOPPED, Status.LEFT]
    assert list(shots.velocity_m_s[:2]) == [0, 0]
    assert np.isnan(shots.exit_time_s[:2]).all()
    empty = gun_velocity(THESIS_GUN, 0.0, 0.5, effects)
    assert (empty.velocity_m_s.tolist(), empty.status.tolist()) == ([0.0], [Status.NOT_STARTED])


def test_velocity_bends_down_with_pressure_and_a_projectile_that_creeps_stays():
    """Fig. 2.12, with every effect on."""
    effects = [kind() for kind in GUN if kind.id != "gun.valve_flow"]
    by_pressure = gun_velocity(THESIS_GUN, np.linspace(1e5, 10e5, 10), 0.5, effects).velocity_m_s
    by_mass = gun_velocity(THESIS_GUN, 5e5, np.linspace(0.3, 2, 10), effects).velocity_m_s
    assert np.all(np.diff(by_pressure) > 0)
    assert np.all(np.diff(by_pressure, 2) < 0)
    assert np.all(np.diff(by_mass) < 0)
    # It slowed down for ever, and took a diagnosis of pairs of effects with it: 200,000 steps, then
    # an error.
    leak = effect("gun.blow_by", discharge_coefficient=1.0, wear_m=2e-3)
    slow = effect(
        "gun.valve_flow", loss_coefficient=0.0, opening_time_s=0.0, steady_loss_coefficient=1e4
    )
    bench = replace(THESIS_GUN, friction_coefficient=0.0)
    assert gun_velocity(bench, 2e5, 0.5, [leak, slow, ABSOLUTE]).words() == [
        "stopped in the barrel"
    ]


def test_ends_have_words_and_other_numbers_of_parameters_and_no_travel_are_refused():
    assert [status.words for status in Status] == ["left", "stopped in the barrel", "did not start"]
    assert [int(status) for status in Status] == [0, 1, 2]
    assert gun_velocity(THESIS_GUN, 4e5, 0.5).words() == ["left"]
    with pytest.raises(ValueError, match="dead_volume_m3 has shape \\(3,\\)"):
        gun_velocity(
            THESIS_GUN, PRESSURE, MASS, [effect("gun.dead_volume", volume_m3=np.full(3, 1e-4))]
        )
    with pytest.raises(ValueError, match="travel_m = 0"):
        gun_velocity(THESIS_GUN, PRESSURE, MASS, travel_m=[0.5, 0.0, 0.5, 0.5])


@pytest.mark.parametrize(
    ("pressure", "mass", "travel", "area"),
    [(16, 1, 1, 1), (1, 100, 1, 1), (1, 1, 9, 1), (1, 1, 1, 4), (4, 9, 16, 25)],
)
def test_similar_shots_are_similar_to_the_last_step(
    pressure: float, mass: float, travel: float, area: float
) -> None:
    """Against the drag of air, in a tank as many times the barrel: v^2 goes with p A L / m, time
    with its own scale.

    Steps and their tolerances scale as the motion does, so that the errors are the same as well.
    """
    wide, drag = area**0.5, mass / (area * travel)
    small = replace(THESIS_GUN, friction_coefficient=0.0)
    large = replace(
        small,
        tank_volume_m3=small.tank_volume_m3 * area * travel,
        bore_diameter_m=small.bore_diameter_m * wide,
        projectile_diameter_m=small.projectile_diameter_m * wide,
        travel_m=small.travel_m * travel,
    )
    one = gun_velocity(
        small, 1e5, 0.3, [effect("gun.barrel_loss", friction_factor=0.0, drag_coefficient=5.0)]
    )
    other = gun_velocity(
        large,
        pressure * 1e5,
        mass * 0.3,
        [effect("gun.barrel_loss", friction_factor=0.0, drag_coefficient=5.0 * drag)],
    )
    speed = (pressure * area * travel / mass) ** 0.5
    np.testing.assert_allclose(other.velocity_m_s / speed, one.velocity_m_s, rtol=3e-12)
    np.testing.assert_allclose(other.exit_time_s * speed / travel, one.exit_time_s, rtol=3e-12)


#: Gauge, from what hardly moves the bullet.
LOW_PRESSURE = np.array([0.05, 0.1, 0.15, 0.2, 0.3, 0.5, 1.0, 3.0]) * 1e5


@pytest.mark.parametrize("mass_kg", [0.1428, 1.0])
@pytest.mark.parametrize("ahead_pa", [0.0, 101_325.0])
def test_gauge_leak_follows_the_balances_at_every_pressure(ahead_pa, mass_kg):
    """A choked leak of what is above the surroundings, with atmosphere ahead and without."""
    effects = [
        effect("gun.blow_by", discharge_coefficient=0.0, gauge_discharge_coefficient=0.6),
        effect("gun.back_pressure", atmosphere_pa=ahead_pa),
    ]
    exit_velocity = gun_velocity(THESIS_GUN, LOW_PRESSURE, mass_kg, effects).velocity_m_s
    expected = by_scipy(LOW_PRESSURE, np.full(LOW_PRESSURE.size, mass_kg), effects, "DOP853", 1e-9)
    np.testing.assert_allclose(exit_velocity, expected, rtol=1e-5)
    assert np.all(np.diff(exit_velocity[exit_velocity > 0]) > 0) and exit_velocity[-1] > 10


def test_tank_at_the_surroundings_pressure_does_not_leak():
    """With the atmosphere the law counts from vacuum: a leak of that pressure would let air out of
    an open tank.

    A gas of no more than the surroundings' pressure pushes a bullet without friction as if there
    were no leak.
    """
    free = replace(THESIS_GUN, friction_coefficient=0.0)
    leak = effect("gun.blow_by", discharge_coefficient=0.0, gauge_discharge_coefficient=1e-3)
    little = np.array([0.02e5, 0.1e5, 0.4e5])
    tight, leaking = (
        gun_velocity(free, little, 0.2, effects).velocity_m_s
        for effects in ([ABSOLUTE], [ABSOLUTE, leak])
    )
    np.testing.assert_allclose(leaking, tight, rtol=5e-3)
