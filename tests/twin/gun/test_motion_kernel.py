"""The compiled motion against the steps of `ode.run` on the same rates; its derivatives, extremes
and flows."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest
from numba import njit
from pyroshock.twin import ode
from pyroshock.twin.effects import Parameter, Value, catalogue, parameter
from pyroshock.twin.gun.bench import GunBench
from pyroshock.twin.gun.chambers import TwoChambers, choked_flow, critical_ratio
from pyroshock.twin.gun.effects.back_pressure import BackPressure
from pyroshock.twin.gun.effects.barrel_loss import BarrelLoss
from pyroshock.twin.gun.effects.blow_by import BlowBy
from pyroshock.twin.gun.effects.valve_flow import ValveFlow
from pyroshock.twin.gun.motion_kernel import derivatives, ellipse, mass_flow, valve_motion
from pyroshock.twin.gun.shot import (
    ATMOSPHERE_PA,
    GAS_CONSTANT,
    GunEffect,
    Instant,
    ShotInputs,
    nominal_shot,
)
from pyroshock.twin.gun.shots import GunShots, Status, gun_velocity
from scipy.stats import qmc

BENCH = GunBench(0.0095, 0.049, 0.048, 0.885, 0.2, 1.4, 1.0)
GUN = [kind for kind in catalogue().values() if issubclass(kind, GunEffect)]


@dataclass(frozen=True)
class AddedDrag(GunEffect):
    """An effect with a hook, so that `ode.run` integrates; heads of outside air, 0 of which change
    nothing."""

    id = "gun.added_drag"
    law = "F = A H rho_air v^2 / 2"
    source = "of this test"
    moves: ClassVar[bool] = True

    heads: Value = parameter("H", "", default=0.0, low=0.0, high=100.0, off=-1.0)  # noqa: RUF009

    def resistance_n(self, shot: ShotInputs, instant: Instant) -> np.ndarray:
        air = ATMOSPHERE_PA / (GAS_CONSTANT * shot.temperature_k)
        return shot.area_m2 * self.heads * air * instant.velocity_m_s**2 / 2


def sample(
    n: int, seed: int, *, valve: bool, likely: bool
) -> tuple[np.ndarray, np.ndarray, list[GunEffect]]:
    """Pressures, masses, and every effect of the catalogue: a Latin hypercube over the ranges,
    crowded near "off"."""
    kinds = [kind for kind in GUN if valve or kind is not ValveFlow]
    items: list[Parameter] = [item for kind in kinds for item in kind.parameters()]
    rng = np.random.default_rng(seed)
    shares = iter(qmc.LatinHypercube(len(items) + 2, rng=rng).random(n).T)
    pressure, mass = 1e3 * 2e3 ** next(shares), 0.05 * 60 ** next(shares)

    def values(item: Parameter) -> np.ndarray:
        low, high = item.likely if likely else (item.low, item.high)
        even = next(shares)
        drawn = low + (high - low) * (even**4 if low == 0 else even)
        return drawn if likely else np.where(rng.random(n) < 0.2, item.off, drawn)

    return (
        pressure,
        mass,
        [kind(**{item.name: values(item) for item in kind.parameters()}) for kind in kinds],
    )


def difference(one: GunShots, other: GunShots) -> np.ndarray:
    """Relative, of velocities."""
    np.testing.assert_array_equal(one.status, other.status)
    return np.abs(one.velocity_m_s[one.left] / other.velocity_m_s[one.left] - 1)


@pytest.mark.parametrize("likely", [True, False], ids=["likely", "all ranges"])
def test_one_and_two_gases_are_as_the_reference_has_them(likely: bool) -> None:
    """Two at steps so fine that both are exact: where friction holds a projectile, coarser ones err
    by chance."""
    every_end = {Status.LEFT, Status.STOPPED, Status.NOT_STARTED}
    pressure, mass, effects = sample(200, 1, valve=False, likely=likely)
    compiled = gun_velocity(BENCH, pressure, mass, effects)
    assert set(compiled.status) == every_end
    assert (
        difference(compiled, gun_velocity(BENCH, pressure, mass, [*effects, AddedDrag()])).max()
        < 1e-9
    )
    pressure, mass, effects = sample(100, 6, valve=True, likely=likely)
    compiled = gun_velocity(BENCH, pressure, mass, effects, 0.1)
    assert set(compiled.status) == every_end
    assert (
        difference(
            compiled, gun_velocity(BENCH, pressure, mass, [*effects, AddedDrag()], 0.1)
        ).max()
        < 2e-6
    )
    usual = difference(gun_velocity(BENCH, pressure, mass, effects), compiled)
    assert np.quantile(usual, 0.9) < 2e-6
    assert usual.max() < 2e-4


def test_a_valve_alone_is_as_the_reference_has_it() -> None:
    rng = np.random.default_rng(3)
    valve = ValveFlow(
        10 ** rng.uniform(-3, 3, 60), rng.uniform(0, 0.3, 60), rng.uniform(0, 100, 60)
    )
    shots = (rng.uniform(0.5e5, 10e5, 60), rng.uniform(0.1, 2, 60))
    compiled, reference = (
        gun_velocity(BENCH, *shots, effects) for effects in ([valve], [valve, AddedDrag()])
    )
    assert difference(compiled, reference).max() < 2e-6
    np.testing.assert_allclose(compiled.exit_time_s, reference.exit_time_s, rtol=2e-6)


@pytest.mark.parametrize("valve", [True, False], ids=["two gases", "one gas"])
def test_a_hook_adds_to_what_the_shot_holds(valve: bool) -> None:
    others = [BlowBy(), *([ValveFlow(loss_coefficient=20.0)] if valve else [])]
    known = gun_velocity(BENCH, [2e5, 6e5], 0.4, [*others, BarrelLoss(drag_coefficient=30.0)])
    added = gun_velocity(
        BENCH, [2e5, 6e5], 0.4, [*others, BarrelLoss(drag_coefficient=10.0), AddedDrag(heads=20.0)]
    )
    np.testing.assert_allclose(added.velocity_m_s, known.velocity_m_s, rtol=2e-6)


def chamber_of(effects: Sequence[GunEffect], n: int) -> TwoChambers:
    shot = nominal_shot(BENCH, np.full(n, 6e5), 0.5)
    for effect in effects:
        shot = effect.prepare(shot)
    return TwoChambers(shot, [])


@njit
def all_derivatives(table, valve, time, state, jacobian, by_time):
    """Of shots with a valve (n,), into (n, 6, 6) by the states (n, 6) and (n, 6) by time."""
    for i in range(time.size):
        since, then, rate, _ = valve_motion(valve[i], time[i])
        derivatives(table[i], since, then, rate, time[i], state[i], jacobian[i], by_time[i])


def test_derivatives_are_those_of_the_rates() -> None:
    """At random instants: gas that flows both ways through valve and leak, moving and held
    projectiles."""
    n, rng = 200, np.random.default_rng(4)
    effects = [
        BackPressure(rng.uniform(9e4, 1.1e5, n)),
        BlowBy(0.5, 1e-3, 0.5),
        BarrelLoss(0.05, 3.0, 5.0),
    ]
    chamber = chamber_of([*effects, ValveFlow(rng.uniform(1, 100, n), 0.1, 2.0)], n)
    time = rng.uniform(0.01, 0.2, n)
    gas_kg, tank_kg = rng.uniform(1e-3, 3e-2, n), rng.uniform(2e-2, 8e-2, n)
    speed = np.where(np.arange(n) % 4, rng.uniform(0.1, 30, n), 5e-5)
    state = np.stack(
        [
            rng.uniform(0.01, 0.8, n),
            speed,
            rng.uniform(2e4, 7e5, n),
            gas_kg,
            rng.uniform(2e4, 7e5, n),
            tank_kg,
        ]
    )
    jacobian, by_time = np.empty((n, 6, 6)), np.empty((n, 6))
    all_derivatives(
        chamber.table, chamber.valve, time, np.ascontiguousarray(state.T), jacobian, by_time
    )
    size = np.array([1.0, 1e-4, 1e5, 1e-2, 1e5, 1e-2])
    scale = np.abs(chamber.rates(time, state)).max(axis=1)
    for j in range(6):
        step = np.zeros((6, 1))
        step[j] = 1e-5 * size[j]
        slope = (chamber.rates(time, state + step) - chamber.rates(time, state - step)).T / (
            2 * step[j]
        )
        off = np.abs(jacobian[:, :, j] - slope) * size[j] / scale
        assert np.quantile(off, 0.98) < 1e-6, j
    slope = (chamber.rates(time + 1e-7, state) - chamber.rates(time - 1e-7, state)).T / 2e-7
    np.testing.assert_allclose(by_time * 0.1 / scale, slope * 0.1 / scale, atol=1e-5)


@pytest.mark.parametrize("coarser", [1.0, 30.0])
def test_no_shot_takes_endless_steps(coarser: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """As they did where friction stops a projectile and an error of the speed is as large as what
    counts as rest."""
    monkeypatch.setattr(ode, "MOST_STEPS", 5000)
    for seed in range(3):
        gun_velocity(BENCH, *sample(1000, seed, valve=True, likely=seed > 0), coarser)


@pytest.mark.parametrize("loss", [1e-6, 1e-3, 1.0, 1e4])
@pytest.mark.parametrize("opening_s", [0.0, 1e-6, 2.0])
def test_extreme_valves_are_integrated(loss: float, opening_s: float) -> None:
    shots = gun_velocity(BENCH, [0.0, 1.0, 1e5, 50e5], 0.5, [ValveFlow(loss, opening_s)])
    assert shots.status[[0, 2, 3]].tolist() == [Status.NOT_STARTED, Status.LEFT, Status.LEFT]
    assert np.isfinite(shots.velocity_m_s).all()
    assert 0 < shots.velocity_m_s[2] < shots.velocity_m_s[3]
    assert np.isfinite(shots.exit_time_s[2:]).all()


def test_a_shot_of_too_many_steps_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ode, "MOST_STEPS", 3)
    for effects in ([BlowBy()], [ValveFlow()]):
        with pytest.raises(RuntimeError, match="shot number 0 of 2 took more than 3 steps"):
            gun_velocity(BENCH, [4e5, 5e5], 0.5, effects)


def test_air_has_the_figures_of_the_books_and_isothermal_gas_their_limit():
    assert critical_ratio(1.4) == pytest.approx(0.5283, abs=5e-5)
    assert choked_flow(1.4) == pytest.approx(0.6847, abs=5e-5)
    for ratio in (1.0, 1 + 1e-12):
        assert critical_ratio(ratio) == pytest.approx(math.exp(-0.5), rel=1e-6)
        assert choked_flow(ratio) == pytest.approx(math.exp(-0.5), rel=1e-6)


def flow(here_pa, there_pa, here_k=300.0, there_k=400.0):
    area, gas, critical = 1e-4 * choked_flow(1.4), GAS_CONSTANT, critical_ratio(1.4)
    pairs = zip(np.atleast_1d(here_pa), np.atleast_1d(there_pa), strict=True)
    return np.array(
        [mass_flow(area, p, gas * here_k, q, gas * there_k, critical) for p, q in pairs]
    )


def test_flow_turns_with_the_pressures_and_is_laminar_next_to_equal_ones():
    expected = 1e-4 * 6e5 * choked_flow(1.4) / math.sqrt(GAS_CONSTANT * 300.0)
    np.testing.assert_allclose(flow([6e5, 6e5], [1e5, 3e5]), [expected] * 2, rtol=6e-4)
    assert flow(6e5, 1e5) == flow(6e5, 3e5)
    forth, back = (
        flow([6e5, 2e5, 1e5], [1e5, 1.5e5, 1e5]),
        flow([1e5, 1.5e5, 1e5], [6e5, 2e5, 1e5], 400.0, 300.0),
    )
    np.testing.assert_allclose(back, -forth, rtol=1e-14)
    assert forth[2] == 0.0
    mixed = flow([6e5, 1e5], [1e5, 6e5])
    assert mixed[1] == pytest.approx(-mixed[0] * math.sqrt(300 / 400))
    # In proportion to the drop below 1e-5, with its root well above.
    critical = critical_ratio(1.4)
    near, two = (ellipse(ratio, critical)[0] for ratio in (1 - 1e-7, 1 - 2e-7))
    assert two / near == pytest.approx(2, rel=1e-3)
    few, many = (ellipse(ratio, critical)[0] for ratio in (0.99, 0.96))
    assert many / few == pytest.approx(2, rel=0.05)
    assert near == pytest.approx(2e-7 / (1 - critical) / math.sqrt(1e-3), rel=1e-3)


def test_empty_volume_that_leaks_more_than_its_valve_lets_in_ends_with_the_shot():
    """Its mass is smaller than the error of a step, which may leave less than nothing of it."""
    shot = nominal_shot(BENCH, 82434.01120090761, 0.4).but(
        valve_area_m2=0.00010428117024741016,
        opening_time_s=0.41881875758588893,
        leak_area_m2=0.00016204855038518093,
        friction_n=24.649337528047834,
    )
    fast, fine = (TwoChambers(shot, [], coarser).run()[0] for coarser in (30.0, 0.1))
    assert fast.reached.all()
    np.testing.assert_allclose(fast.state[:, 0], fine.state[:, 0], rtol=1e-4)
