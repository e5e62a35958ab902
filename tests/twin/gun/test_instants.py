"""The gun at one instant: what effects make of a shot, forces and flows, each by its formula."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import ArrayLike
from pyroshock.twin import ode
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
from pyroshock.twin.gun.shot import GAS_CONSTANT, GunEffect, ShotInputs, nominal_shot
from pyroshock.twin.gun.shots import (
    Status,
    gun_velocity,
    ideal_velocity_m_s,
    net_work_j,
    starting_force_n,
    travel_time_s,
)

BENCH = GunBench(9.5e-3, 0.049, 0.048, 0.885, 0.3, 1.4, 1.0)
AREA, AIR = math.pi / 4 * 0.048**2, 101_325.0
OUTSIDE = AIR / (GAS_CONSTANT * 293.15)


def prepared(effects: Sequence[GunEffect], pressure_pa: ArrayLike = 4e5) -> ShotInputs:
    """Shots of 0.5 kg."""
    shot = nominal_shot(BENCH, pressure_pa, 0.5)
    for effect in effects:
        shot = effect.prepare(shot)
    return shot


def half_way(effects: Sequence[GunEffect], pressure_pa: float = 3e5, kelvin: float = 280.0) -> tuple[float, float]:
    """Resistance beyond constant friction (N) and leak (kg/s), half way at 20 m/s, at an absolute pressure."""
    shot = prepared(effects)
    chamber = Chamber(shot, [])
    law_pa = pressure_pa - float(shot.pressure_zero_pa[0])
    mass = pressure_pa * (BENCH.tank_volume_m3 + AREA * 0.5) / (GAS_CONSTANT * kelvin)
    rates = chamber.rates(np.zeros(1), np.array([[0.5], [20.0], [law_pa], [mass]]))[:, 0]
    return law_pa * AREA - float(chamber.drag_n[0]) - 0.5 * float(rates[1]), -float(rates[3])


@pytest.fixture(autouse=True)
def no_endless_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    """No shot takes as many."""
    monkeypatch.setattr(ode, "MOST_STEPS", 2000)


# --- what effects make of a shot ---


def test_effects_prepare_what_a_shot_holds() -> None:
    """A nominal shot has no valve, no leak and no atmosphere. Back pressure opposes and is the atmosphere that flows
    see, on a bench below standard pressure the standard one. A dead volume shares the tank's energy; friction is of
    weight and of a seal; a valve has the bore's area over the root of its loss."""
    shot = prepared([])
    absent = (shot.dead_volume_m3, shot.opposing_pressure_pa, shot.leak_area_m2, shot.opening_time_s)
    assert [float(quantity[0]) for quantity in absent] == [0, 0, 0, 0]
    assert np.isinf(shot.valve_area_m2[0])
    assert shot.pressure_zero_pa[0] == AIR
    assert shot.friction_n[0] == pytest.approx(0.3 * 0.5 * 9.80665)
    high, low = prepared([BackPressure(atmosphere_pa=1.05e5)]), prepared([BackPressure(atmosphere_pa=0.9e5)])
    assert (high.opposing_pressure_pa[0], high.atmosphere_pa[0]) == (1.05e5, 1.05e5)
    assert (low.opposing_pressure_pa[0], low.atmosphere_pa[0]) == (0.9e5, AIR)
    assert high.driving_pressure_pa[0] == 5.05e5
    assert low.pressure_zero_pa[0] == pytest.approx(AIR - 0.9e5)
    dead = prepared([DeadVolume(volume_m3=5e-4), BackPressure(atmosphere_pa=AIR)])
    assert dead.volume_m3[0] == pytest.approx(1e-2)
    assert dead.filled_pressure_pa[0] == pytest.approx(((4e5 + AIR) * 9.5e-3 + AIR * 5e-4) / 1e-2, rel=1e-12)
    rubbing = prepared([SlidingFriction(added_coefficient=0.2, seal_force_n=7.0, seal_share=0.1)])
    assert rubbing.friction_n[0] == pytest.approx(0.5 * 0.5 * 9.80665 + 7.0 + 0.1 * 4e5 * AREA, rel=1e-12)
    assert starting_force_n(rubbing)[0] == pytest.approx(4e5 * AREA - rubbing.friction_n[0], rel=1e-12)
    valve = prepared([ValveFlow(loss_coefficient=9.0, opening_time_s=0.2)])
    assert valve.valve_area_m2[0] == pytest.approx(math.pi / 4 * 0.049**2 / 3, rel=1e-12)
    assert valve.opening_time_s[0] == 0.2
    assert np.isinf(prepared([ValveFlow(loss_coefficient=0.0)]).valve_area_m2[0])


def test_valve_and_barrel_drag_by_their_heads() -> None:
    """A steady valve with outside air; a barrel by its column, the air ahead and the entrance, where gas that has no
    pressure loses none; both add up."""
    steady = ValveFlow(loss_coefficient=0.0, opening_time_s=0.0, steady_loss_coefficient=12.0)
    assert half_way([steady])[0] == pytest.approx(12.0 * AREA * OUTSIDE * 20.0**2 / 2, rel=1e-9)
    assert half_way([])[0] == pytest.approx(0, abs=1e-9)
    loss = BarrelLoss(friction_factor=0.03, drag_coefficient=2.0, gas_heads=1.5)
    gas, gauge = (pressure / (GAS_CONSTANT * 280.0) for pressure in (3e5, 3e5 - AIR))
    heads = 0.03 * 0.5 / 0.049 * gas + 2.0 * OUTSIDE + 1.5 * gauge
    assert half_way([loss])[0] == pytest.approx(AREA * heads * 200.0, rel=1e-9)
    valve = ValveFlow(loss_coefficient=0.0, opening_time_s=0.0, steady_loss_coefficient=3.0)
    drag = BarrelLoss(friction_factor=0.0, drag_coefficient=2.0)
    for effects in ([valve, drag], [drag, valve]):
        assert prepared(effects).air_heads[0] == 5.0
        assert half_way(effects)[0] == pytest.approx(5.0 * AREA * OUTSIDE * 200.0, rel=1e-9)
    entrance = BarrelLoss(friction_factor=0.0, drag_coefficient=0.0, gas_heads=10.0)
    assert half_way([entrance], AIR - 2e3)[0] == pytest.approx(0, abs=1e-9)
    dense = 3e4 / (GAS_CONSTANT * 280.0)
    assert half_way([entrance], AIR + 3e4)[0] == pytest.approx(AREA * 10.0 * dense * 20.0**2 / 2, rel=1e-9)


def choked_kg_s(area_m2: float, pressure_pa: float, temperature_k: float) -> float:
    """Of air through a nozzle, where the other side has less than half the pressure."""
    return area_m2 * math.sqrt(1.4) * 1.2**-3 * pressure_pa / math.sqrt(GAS_CONSTANT * temperature_k)


def test_blow_by_goes_through_the_ring() -> None:
    """With wear on both sides of it; a gauge flow goes through the ring as it was made, by gauge pressure alone."""
    worn = BlowBy(discharge_coefficient=0.7, wear_m=4e-4)
    ring = 0.7 * math.pi / 4 * (0.0498**2 - 0.048**2)
    assert prepared([worn]).leak_area_m2[0] == pytest.approx(ring, rel=1e-12)
    assert half_way([worn])[1] == pytest.approx(choked_kg_s(ring, 3e5, 280.0), rel=2e-3)
    both = BlowBy(discharge_coefficient=0.7, wear_m=4e-4, gauge_discharge_coefficient=0.5)
    added = half_way([both])[1] - half_way([worn])[1]
    made = 0.5 * math.pi / 4 * (0.049**2 - 0.048**2)
    assert added == pytest.approx(choked_kg_s(made, 3e5 - AIR, 280.0), rel=1e-9)
    assert half_way([both], 0.9e5)[1] == half_way([worn], 0.9e5)[1]


# --- in closed form ---


@pytest.mark.parametrize("share", [0.0, 0.6, 1.0])
def test_work_is_the_integral_of_the_force(share: float) -> None:
    effects = [HeatExchange(share=share), DeadVolume(volume_m3=3e-4), BackPressure(), SlidingFriction()]
    shot = prepared(effects)
    nodes, weights = np.polynomial.legendre.leggauss(30)
    x = 0.6 * (nodes + 1) / 2
    volume = 9.8e-3 + AREA * x
    force = shot.filled_pressure_pa * (9.8e-3 / volume) ** (1.4 - 0.4 * share) * AREA - AIR * AREA - shot.friction_n
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
        np.testing.assert_allclose(gun_velocity(half, [2e5, 4e5], 0.5, effects).velocity_m_s, whole.velocity_m_s / 2)


# --- gases ---


def chamber_of(kind: type[Chamber], effects: Sequence[GunEffect], pressure_pa: ArrayLike) -> Chamber:
    return kind(prepared(effects, pressure_pa), [])


def test_gases_begin_as_they_were_filled() -> None:
    """Tank and dead volume as one, or with the valve's passage, 1e-4 of the tank, on the barrel's side."""
    effects = [BackPressure(), DeadVolume(volume_m3=5e-4)]
    room, tank_pa = GAS_CONSTANT * 293.15, 4e5 + AIR
    one = chamber_of(Chamber, effects, 4e5).start()[:, 0]
    np.testing.assert_allclose(
        one, [0, 0, (tank_pa * 9.5e-3 + AIR * 5e-4) / 1e-2, (tank_pa * 9.5e-3 + AIR * 5e-4) / room], rtol=1e-12
    )
    behind_valve = chamber_of(TwoChambers, [*effects, ValveFlow()], 4e5)
    energy = tank_pa * 9.5e-7 + AIR * 5e-4
    two = behind_valve.start()[:, 0]
    expected = [0, 0, energy / 5.0095e-4, energy / room, tank_pa, tank_pa * 9.5e-3 * (1 - 1e-4) / room]
    np.testing.assert_allclose(two, expected, rtol=1e-12)
    np.testing.assert_allclose(behind_valve.volume_m3, 5.0095e-4, rtol=1e-12)


@pytest.mark.parametrize("opening_s", [0.2, 1.5])
def test_an_opening_valve_shows_what_two_circles_share(opening_s: float) -> None:
    """One that takes no time is open."""
    shares = np.array([0.0, 0.1, 0.5, 0.9, 1.0, 1.7])
    across = np.linspace(-1, 1, 400_001)
    chord = np.sqrt(1 - across**2)
    apart = 2 * (1 - np.minimum(shares, 1))
    common = [np.trapezoid(np.clip(2 * chord - d, 0, None), across) / np.pi for d in apart]
    assert [open_share(share)[0] for share in shares] == pytest.approx(common, abs=1e-6)
    for takes_s, expected in ((opening_s, common), (0.0, np.ones(6))):
        valve = ValveFlow(loss_coefficient=100.0, opening_time_s=takes_s)
        chamber = TwoChambers(prepared([valve], np.full(6, 4e5)), [])
        state = chamber.start()
        state[2] = 0.3 * state[4]  # choked
        flow = chamber.rates(shares * opening_s, state)[3]
        np.testing.assert_allclose(flow / flow[-1], expected, rtol=0, atol=1e-6 if takes_s else 0)
        assert flow[-1] > 0


def test_forces_at_rest_hold_and_do_not_pull_back() -> None:
    """Friction that is more than the push: nothing at rest, all of it from a creep of 0.1 mm/s on."""
    chamber = chamber_of(
        Chamber, [SlidingFriction(seal_force_n=1000.0), BarrelLoss(drag_coefficient=0.0)], np.full(5, 1e5)
    )
    state = np.array([np.full(5, 0.2), [0.0, 0.5e-4, 1e-4, 1.0, -1.0], np.full(5, 0.8e5), np.full(5, 0.02)])
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


def test_gas_leaks_at_its_own_temperature_and_air_comes_in_at_that_outside() -> None:
    """dp/dt over dM/dt at rest is n R T / V of what flows: two shots at once, one above the atmosphere, one below."""
    chamber = chamber_of(Chamber, [BackPressure(), BlowBy(wear_m=1e-3)], [4e5, 4e5])
    volume = BENCH.tank_volume_m3 + AREA * 0.5
    pressure, mass = np.array([4e5, 0.4e5]), np.array([0.06, 0.009])
    state = np.stack([np.full(2, 0.5), np.zeros(2), pressure, mass])
    rates = chamber.rates(np.zeros(2), state)
    inside_k = pressure[0] * volume / (GAS_CONSTANT * mass[0])
    assert rates[3, 0] < 0 < rates[3, 1]
    np.testing.assert_allclose(
        rates[2] / rates[3], 1.4 * GAS_CONSTANT * np.array([inside_k, 293.15]) / volume, rtol=1e-12
    )
    ring = 0.6 * math.pi / 4 * (0.051**2 - 0.048**2)
    expected = [-choked_kg_s(ring, 4e5, inside_k), choked_kg_s(ring, 101_325.0, 293.15)]
    np.testing.assert_allclose(rates[3], expected, rtol=2e-3)


@pytest.mark.parametrize(("tank_pa", "behind_pa"), [(8e5, 2e5), (2e5, 8e5)], ids=["into the barrel", "back"])
def test_gas_goes_through_the_valve_at_the_temperature_where_it_comes_from(tank_pa: float, behind_pa: float) -> None:
    chamber = chamber_of(TwoChambers, [BackPressure(), ValveFlow(loss_coefficient=100.0, opening_time_s=0.0)], 8e5)
    assert isinstance(chamber, TwoChambers)
    tank_m3 = float(chamber.tank_m3[0])
    barrel_m3 = float(chamber.volume_m3[0]) + AREA * 0.7
    tank_kg, barrel_kg = tank_pa * tank_m3 / (GAS_CONSTANT * 250.0), behind_pa * barrel_m3 / (GAS_CONSTANT * 330.0)
    state = np.array([[0.7], [0.0], [behind_pa], [barrel_kg], [tank_pa], [tank_kg]])
    rates = chamber.rates(np.full(1, 0.1), state)[:, 0]
    forth = tank_pa > behind_pa
    from_k = 250.0 if forth else 330.0
    flow = choked_kg_s(math.pi / 4 * BENCH.bore_diameter_m**2 / 10, 8e5, from_k) * (1 if forth else -1)
    np.testing.assert_allclose([rates[3], rates[5]], [flow, -flow], rtol=2e-3)
    energy = 1.4 * GAS_CONSTANT * from_k * rates[3]
    np.testing.assert_allclose([rates[2] * barrel_m3, rates[4] * tank_m3], [energy, -energy], rtol=1e-12)


def test_a_shot_is_given_up_at_rest_without_push_or_after_very_long() -> None:
    """Some hundred times what the tank's pressure alone takes, sqrt(L m / (p A)), which is longer for heavy shots. A
    shot waits for its valve: at rest it has the tank's pressure to come, and while the valve opens no time is lost."""
    effects = [BackPressure(), BlowBy(), SlidingFriction(seal_force_n=50.0)]
    chamber = chamber_of(Chamber, effects, np.full(6, 4e5))
    drag_pa = float(chamber.drag_n[0]) / AREA
    position = np.array([0.5, 0.0, 0.0, 0.5, 0.0, 0.5])
    speed = np.array([0.0, 0.0, 1.0, 0.0, 0.0, 1.0])
    pressure = drag_pa * np.array([0.99, 0.99, 0.99, 1.01, 1.01, 1.01])
    state = np.stack([position, speed, pressure, np.full(6, 0.04)])
    fall_s = math.sqrt(BENCH.travel_m * 0.5 / (AREA * (4e5 + 101_325.0)))
    assert chamber.given_up(np.full(6, fall_s), state).tolist() == [True, True, False, False, False, False]
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
    """1 - exp(-r sqrt(2 L m / (p A))) of it, down to pressures of a pascal; an empty tank's index is a number."""
    pressure = np.array([1.2, 1.5, 1e3, 4e5])
    shot = HeatExchange(share=0.1, rate_1_s=0.05).prepare(nominal_shot(BENCH, pressure, 0.5))
    time = np.sqrt(2 * BENCH.travel_m * 0.5 / (pressure * AREA))
    share = np.minimum(0.1 + 1 - np.exp(-0.05 * time), 1.0)
    assert share[1] < 1
    np.testing.assert_allclose(shot.polytropic_index, 1.4 - 0.4 * share, rtol=1e-12)
    empty = HeatExchange(share=0.25, rate_1_s=0.0).prepare(nominal_shot(BENCH, 0.0, 0.5))
    np.testing.assert_allclose(empty.polytropic_index, 1.3, rtol=1e-12)


# --- shots ---


def test_shots_that_leave_are_told_apart() -> None:
    """One at less than 1 m/s that leaves all the same, one that stops on its way, one that does not start."""
    slow = replace(BENCH, friction_coefficient=0.0)
    crawl = gun_velocity(slow, [50.0, 4e5], 0.5)
    assert 0 < crawl.velocity_m_s[0] < 1 < crawl.velocity_m_s[1]
    assert crawl.left.tolist() == [True, True]
    assert crawl.exit_time_s[0] == pytest.approx(2 * 0.885 / crawl.velocity_m_s[0], rel=0.2)
    for effects in ([], [BlowBy()]):
        small = gun_velocity(replace(BENCH, tank_volume_m3=2e-4), [4e5, 6e3, 100.0], [0.5, 3.0, 0.5], effects)
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
    np.testing.assert_allclose(together.velocity_m_s, [one.velocity_m_s[0] for one in alone], rtol=1e-7)
    np.testing.assert_allclose(together.exit_time_s, [one.exit_time_s[0] for one in alone], rtol=1e-6)
    assert together.velocity_m_s.argmax() == 0 and together.velocity_m_s.argmin() == 3
    assert together.left.all()
