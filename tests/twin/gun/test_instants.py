"""The gun at one instant: what effects make of a shot, forces and flows, each by its formula."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import ArrayLike
from pyroshock.twin import ode
from pyroshock.twin.effects import Parameter
from pyroshock.twin.gun.bench import GunBench
from pyroshock.twin.gun.chambers import Chamber, TwoChambers
from pyroshock.twin.gun.effects.back_pressure import BackPressure
from pyroshock.twin.gun.effects.barrel_loss import BarrelLoss
from pyroshock.twin.gun.effects.blow_by import BlowBy
from pyroshock.twin.gun.effects.dead_volume import DeadVolume
from pyroshock.twin.gun.effects.heat_exchange import HeatExchange
from pyroshock.twin.gun.effects.sliding_friction import SlidingFriction
from pyroshock.twin.gun.effects.valve_flow import ValveFlow
from pyroshock.twin.gun.motion_kernel import open_share
from pyroshock.twin.gun.shot import GAS_CONSTANT, VACUUM_PA, GunEffect, ShotInputs, nominal_shot
from pyroshock.twin.gun.shots import (
    Status,
    gun_velocity,
    ideal_velocity_m_s,
    net_work_j,
    starting_force_n,
    travel_time_s,
)
from support.records.scalar_gun import WITHIN, scalar_guns

BENCH = GunBench(9.5e-3, 0.049, 0.048, 0.885, 0.3, 1.4, 1.0)
AREA, AIR = math.pi / 4 * 0.048**2, 101_325.0


def prepared(effects: Sequence[GunEffect], pressure_pa: ArrayLike = 4e5) -> ShotInputs:
    """Shots of 0.5 kg."""
    shot = nominal_shot(BENCH, pressure_pa, 0.5)
    for effect in effects:
        shot = effect.prepare(shot)
    return shot


@pytest.fixture(autouse=True)
def no_endless_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    """No shot takes as many."""
    monkeypatch.setattr(ode, "MOST_STEPS", 2000)


def test_effects_prepare_what_a_shot_holds() -> None:
    """A nominal shot has no valve, no leak and no atmosphere: it stands in a vacuum. Back pressure
    opposes and is the atmosphere that flows see. A dead volume shares the tank's energy; friction
    is of weight and of a seal; a valve has the bore's area over the root of its loss."""
    shot = prepared([])
    absent = (
        shot.dead_volume_m3,
        shot.opposing_pressure_pa,
        shot.leak_area_m2,
        shot.opening_time_s,
    )
    assert [float(quantity[0]) for quantity in absent] == [0, 0, 0, 0]
    assert np.isinf(shot.valve_area_m2[0])
    assert shot.pressure_zero_pa[0] == shot.atmosphere_pa[0] == VACUUM_PA
    assert shot.friction_n[0] == pytest.approx(0.3 * 0.5 * 9.80665)
    high, low = (
        prepared([BackPressure(atmosphere_pa=1.05e5)]),
        prepared([BackPressure(atmosphere_pa=0.9e5)]),
    )
    assert (high.opposing_pressure_pa[0], high.atmosphere_pa[0]) == (1.05e5, 1.05e5)
    assert (low.opposing_pressure_pa[0], low.atmosphere_pa[0]) == (0.9e5, 0.9e5)
    assert high.driving_pressure_pa[0] == 5.05e5
    assert low.pressure_zero_pa[0] == 0.0
    dead = prepared([DeadVolume(volume_m3=5e-4), BackPressure(atmosphere_pa=AIR)])
    assert dead.volume_m3[0] == pytest.approx(1e-2)
    assert dead.filled_pressure_pa[0] == pytest.approx(
        ((4e5 + AIR) * 9.5e-3 + AIR * 5e-4) / 1e-2, rel=1e-12
    )
    rubbing = prepared([SlidingFriction(added_coefficient=0.2, seal_force_n=7.0, seal_share=0.1)])
    assert rubbing.friction_n[0] == pytest.approx(
        0.5 * 0.5 * 9.80665 + 7.0 + 0.1 * 4e5 * AREA, rel=1e-12
    )
    assert starting_force_n(rubbing)[0] == pytest.approx(
        4e5 * AREA - rubbing.friction_n[0], rel=1e-12
    )
    valve = prepared([ValveFlow(loss_coefficient=9.0, opening_time_s=0.2)])
    assert valve.valve_area_m2[0] == pytest.approx(math.pi / 4 * 0.049**2 / 3, rel=1e-12)
    assert valve.opening_time_s[0] == 0.2
    assert np.isinf(prepared([ValveFlow(loss_coefficient=0.0)]).valve_area_m2[0])


@pytest.mark.parametrize("kind", [Chamber, TwoChambers])
def test_start_and_rates_are_those_of_the_scalar_gun(kind: type[Chamber]) -> None:
    """Gas that flows both ways through leak and valve, at its own temperature or that outside; drag
    by all heads; tank and dead volume as one, or with the valve's passage, 1e-4 of the tank, on the
    barrel's side."""
    n, rng = 300, np.random.default_rng(8)

    def drawn(item: Parameter) -> np.ndarray:
        low, high = WITHIN[item.name]
        off = low if item.name == "loss_coefficient" else item.off
        return np.where(rng.random(n) < 1 / 3, off, rng.uniform(low, high, n))

    kinds: list[type[GunEffect]] = [
        BackPressure,
        BarrelLoss,
        BlowBy,
        DeadVolume,
        HeatExchange,
        SlidingFriction,
    ]
    kinds += [ValveFlow] if kind is TwoChambers else []
    effects = [
        effect(**{item.name: drawn(item) for item in effect.parameters()}) for effect in kinds
    ]
    pressure, mass = rng.uniform(2e5, 10e5, n), rng.uniform(0.1, 1.5, n)
    shot = nominal_shot(BENCH, pressure, mass)
    for effect in effects:
        shot = effect.prepare(shot)
    chamber, guns = kind(shot, []), scalar_guns(BENCH, pressure, mass, effects)
    start = chamber.start()
    np.testing.assert_allclose(start.T, [gun.start() for gun in guns], rtol=1e-12)
    x, speed, kelvin = (
        rng.uniform(0.01, 0.885, n),
        rng.uniform(0.1, 30, n),
        rng.uniform(150, 600, (2, n)),
    )
    absolute = rng.uniform(2e4, 7e5, (2, n))
    gas = [
        absolute[0] - shot.pressure_zero_pa,
        absolute[0] * (chamber.volume_m3 + AREA * x) / (GAS_CONSTANT * kelvin[0]),
    ]
    if isinstance(chamber, TwoChambers):
        gas += [
            absolute[1] - shot.pressure_zero_pa,
            absolute[1] * chamber.tank_m3 / (GAS_CONSTANT * kelvin[1]),
        ]
    state = np.stack([x, speed, *gas])
    time = rng.uniform(0, 0.3, n)
    expected = [gun.rates(*instant) for gun, *instant in zip(guns, time, state.T, strict=True)]
    rates = chamber.rates(time, state).T
    np.testing.assert_allclose(
        rates, expected, rtol=1e-9, atol=1e-9 * np.abs(rates).max(axis=0).min()
    )


@pytest.mark.parametrize("share", [0.0, 0.6, 1.0])
def test_work_is_the_integral_of_the_force(share: float) -> None:
    effects = [
        HeatExchange(share=share),
        DeadVolume(volume_m3=3e-4),
        BackPressure(),
        SlidingFriction(),
    ]
    shot = prepared(effects)
    nodes, weights = np.polynomial.legendre.leggauss(30)
    x = 0.6 * (nodes + 1) / 2
    volume = 9.8e-3 + AREA * x
    force = (
        shot.filled_pressure_pa * (9.8e-3 / volume) ** (1.4 - 0.4 * share) * AREA
        - AIR * AREA
        - shot.friction_n
    )
    assert net_work_j(shot, np.array([0.6]))[0] == pytest.approx(0.3 * weights @ force, rel=1e-12)
    assert starting_force_n(shot)[0] == pytest.approx(
        (shot.filled_pressure_pa[0] - AIR) * AREA - shot.friction_n[0], rel=1e-12
    )
    leaves = math.sqrt(2 * net_work_j(shot, shot.travel_m)[0] / 0.5)
    assert ideal_velocity_m_s(shot)[0] == pytest.approx(leaves, rel=1e-12)


def test_work_of_an_endless_tank_is_even_and_efficiency_stands_before_every_velocity() -> None:
    shot = prepared([]).but(tank_volume_m3=1e9)
    push = 4e5 * AREA - 0.3 * 0.5 * 9.80665
    assert travel_time_s(shot)[0] == pytest.approx(math.sqrt(2 * 0.885 * 0.5 / push), rel=1e-6)
    assert ideal_velocity_m_s(shot)[0] == pytest.approx(math.sqrt(2 * 0.885 * push / 0.5), rel=1e-6)
    held = prepared([SlidingFriction(seal_force_n=1000.0)])
    assert ideal_velocity_m_s(held)[0] == 0
    half = replace(BENCH, efficiency=0.5)
    for effects in ([], [BarrelLoss()], [ValveFlow(loss_coefficient=10.0)]):
        whole = gun_velocity(BENCH, [2e5, 4e5], 0.5, effects)
        np.testing.assert_allclose(
            gun_velocity(half, [2e5, 4e5], 0.5, effects).velocity_m_s, whole.velocity_m_s / 2
        )


def chamber_of(
    kind: type[Chamber], effects: Sequence[GunEffect], pressure_pa: ArrayLike
) -> Chamber:
    return kind(prepared(effects, pressure_pa), [])


def test_an_opening_valve_shows_what_two_circles_share() -> None:
    shares = np.array([0.0, 0.1, 0.5, 0.9, 1.0, 1.7])
    chord = np.sqrt(1 - np.linspace(-1, 1, 400_001) ** 2)
    apart = 2 * (1 - np.minimum(shares, 1))
    common = [np.trapezoid(np.clip(2 * chord - d, 0, None), dx=1 / 200_000) / np.pi for d in apart]
    assert [open_share(share)[0] for share in shares] == pytest.approx(common, abs=1e-6)


def test_forces_at_rest_hold_and_do_not_pull_back() -> None:
    """Friction that is more than the push: nothing at rest, all of it from a creep of 0.1 mm/s
    on."""
    chamber = chamber_of(
        Chamber,
        [SlidingFriction(seal_force_n=1000.0), BarrelLoss(drag_coefficient=0.0)],
        np.full(5, 1e5),
    )
    state = np.array(
        [np.full(5, 0.2), [0.0, 0.5e-4, 1e-4, 1.0, -1.0], np.full(5, 0.8e5), np.full(5, 0.02)]
    )
    rates = chamber.rates(np.zeros(5), state)
    short = 0.8e5 * AREA - float(chamber.drag_n[0])
    column = 0.02 * 0.2 / 0.049 * 0.02 / (9.5e-3 + AREA * 0.2) * AREA / 2
    np.testing.assert_allclose(
        rates[1], short * np.array([0, 0.5, 1, 1, 0]) / 0.5 - [0, 0, 0, column / 0.5, 0], rtol=1e-6
    )
    forward = np.maximum(state[1], 0)  # a step that is only tried may go back
    np.testing.assert_allclose(rates[0], forward, rtol=1e-15)
    pushed = state[2] * AREA * forward
    np.testing.assert_allclose(rates[2], -1.4 / (9.5e-3 + AREA * 0.2) * pushed, rtol=1e-12)
    assert (rates[3] == 0).all()


def test_a_shot_is_given_up_at_rest_without_push_or_after_very_long() -> None:
    """Some hundred times what the tank's pressure alone takes, sqrt(L m / (p A)), which is longer
    for heavy shots. A shot waits for its valve: at rest it has the tank's pressure to come, and
    while the valve opens no time is lost."""
    effects = [BackPressure(), BlowBy(), SlidingFriction(seal_force_n=50.0)]
    chamber = chamber_of(Chamber, effects, np.full(6, 4e5))
    drag_pa = float(chamber.drag_n[0]) / AREA
    position = np.array([0.5, 0.0, 0.0, 0.5, 0.0, 0.5])
    speed = np.array([0.0, 0.0, 1.0, 0.0, 0.0, 1.0])
    pressure = drag_pa * np.array([0.99, 0.99, 0.99, 1.01, 1.01, 1.01])
    state = np.stack([position, speed, pressure, np.full(6, 0.04)])
    fall_s = math.sqrt(BENCH.travel_m * 0.5 / (AREA * (4e5 + 101_325.0)))
    assert chamber.given_up(np.full(6, fall_s), state).tolist() == [
        True,
        True,
        False,
        False,
        False,
        False,
    ]
    assert chamber.given_up(np.full(6, 1000 * fall_s), state).all()
    mass = np.array([0.02, 0.5, 8.0])
    moving = Chamber(nominal_shot(replace(BENCH, travel_m=0.3), 4e5, mass), [])
    state = np.array([np.full(3, 0.1), np.full(3, 1.0), np.full(3, 1e5), np.full(3, 0.02)])
    falls_s = np.sqrt(0.3 * mass / (4e5 * AREA))
    assert not moving.given_up(50 * falls_s, state).any()
    assert moving.given_up(200 * falls_s, state).all()
    waiting = chamber_of(TwoChambers, [ValveFlow(loss_coefficient=1.0, opening_time_s=2.0)], 8e5)
    for time in (0.0, 2.0):
        assert not waiting.given_up(np.full(1, time), waiting.start())[0]


def test_heat_that_takes_time_comes_by_the_time_of_the_shot() -> None:
    """1 - exp(-r sqrt(2 L m / (p A))) of it, down to pressures of a pascal; an empty tank's index
    is a number."""
    pressure = np.array([1.2, 1.5, 1e3, 4e5])
    shot = HeatExchange(share=0.1, rate_1_s=0.05).prepare(nominal_shot(BENCH, pressure, 0.5))
    time = np.sqrt(2 * BENCH.travel_m * 0.5 / (pressure * AREA))
    share = np.minimum(0.1 + 1 - np.exp(-0.05 * time), 1.0)
    assert share[1] < 1
    np.testing.assert_allclose(shot.polytropic_index, 1.4 - 0.4 * share, rtol=1e-12)
    empty = HeatExchange(share=0.25, rate_1_s=0.0).prepare(nominal_shot(BENCH, 0.0, 0.5))
    np.testing.assert_allclose(empty.polytropic_index, 1.3, rtol=1e-12)


def test_shots_that_leave_are_told_apart() -> None:
    """One at less than 1 m/s that leaves all the same, one that stops on its way, one that does not
    start."""
    slow = replace(BENCH, friction_coefficient=0.0)
    crawl = gun_velocity(slow, [50.0, 4e5], 0.5)
    assert 0 < crawl.velocity_m_s[0] < 1 < crawl.velocity_m_s[1]
    assert crawl.left.tolist() == [True, True]
    assert crawl.exit_time_s[0] == pytest.approx(2 * 0.885 / crawl.velocity_m_s[0], rel=0.2)
    for effects in ([], [BlowBy()]):
        small = gun_velocity(
            replace(BENCH, tank_volume_m3=2e-4), [4e5, 6e3, 100.0], [0.5, 3.0, 0.5], effects
        )
        assert small.status.tolist() == [Status.LEFT, Status.STOPPED, Status.NOT_STARTED]
        assert small.left.tolist() == [True, False, False]
        assert np.isnan(small.exit_time_s).tolist() == [False, True, True]
        assert small.words() == ["left", "stopped in the barrel", "did not start"]
        assert small.velocity_m_s[1:].tolist() == [0, 0]


def test_each_shot_goes_the_way_of_its_own_effects() -> None:
    """No effect, a loss, a valve, both: as each alone, in one call."""
    loss, valve = np.array([0.0, 2.0, 0.0, 2.0]), np.array([0.0, 0.0, 10.0, 10.0])

    def effects(drag: ArrayLike, coefficient: ArrayLike) -> list[GunEffect]:
        return [
            BarrelLoss(friction_factor=0.0, drag_coefficient=np.asarray(drag)),
            ValveFlow(loss_coefficient=np.asarray(coefficient), opening_time_s=0.0),
        ]

    together = gun_velocity(BENCH, 4e5, np.full(4, 0.5), effects(loss, valve))
    alone = [gun_velocity(BENCH, 4e5, 0.5, effects(*one)) for one in zip(loss, valve, strict=True)]
    np.testing.assert_allclose(
        together.velocity_m_s, [one.velocity_m_s[0] for one in alone], rtol=1e-7
    )
    np.testing.assert_allclose(
        together.exit_time_s, [one.exit_time_s[0] for one in alone], rtol=1e-6
    )
    assert together.velocity_m_s.argmax() == 0 and together.velocity_m_s.argmin() == 3
    assert together.left.all()
