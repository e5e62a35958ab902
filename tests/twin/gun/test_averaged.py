"""The mean of guns that are not told apart: closed forms of two guns, and a twin that has them."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
from pyroshock.twin.chain import Twin
from pyroshock.twin.effects import effect
from pyroshock.twin.gun.averaged import AveragedGunStage
from pyroshock.twin.gun.stage import GunStage
from pyroshock.twin.plate.stage import PlateSpread, PlateStage
from pyroshock.twin.sensors.chain import SensorChain
from support.records.twin_parts import BENCH, HalfSine, ringing_plate, setting

NOMINAL = SensorChain()
VALVE = GunStage(
    BENCH, 0.02, (effect("gun.valve_flow", loss_coefficient=30.0, opening_time_s=0.0),)
)
BORE = GunStage(
    BENCH, 0.02, (effect("gun.barrel_loss", friction_factor=0.02, drag_coefficient=2.0),)
)
STUCK = GunStage(BENCH, 0.02, (effect("gun.sliding_friction", seal_force_n=900.0),))
SETTINGS = [setting(tank_pressure_pa=p) for p in (2e5, 5e5)]


def test_velocity_is_the_weighted_mean_of_the_guns() -> None:
    mean = AveragedGunStage.of([(0.3, VALVE), (0.7, BORE)])
    parts = [gun.velocities(SETTINGS, NOMINAL) for gun in (VALVE, BORE)]
    assert np.ptp(parts, axis=0).min() > 0.1
    wanted = 0.3 * parts[0] + 0.7 * parts[1]
    np.testing.assert_allclose(mean.velocities(SETTINGS, NOMINAL), wanted)
    pressure, mass = np.array([2e5, 5e5]), np.full(2, 0.5)
    np.testing.assert_allclose(mean.fired(pressure, mass), wanted)
    assert mean.effects == BORE.effects  # those of the likelier one
    assert mean.label == "eq. 2.16 + mean of gun.valve_flow and gun.barrel_loss"


def test_random_shots_are_of_one_gun_each_as_often_as_it_weighs() -> None:
    mean = AveragedGunStage.of([(0.3, VALVE), (0.7, BORE)])
    assert mean.normals == VALVE.normals + 1
    z = np.random.default_rng(0).standard_normal((4000, mean.normals))
    drawn = np.log(mean.velocity_draws(SETTINGS, NOMINAL, z)[:, 0])
    slow, fast = sorted(np.log(gun.velocities(SETTINGS, NOMINAL)[0]) for gun in (VALVE, BORE))
    weight_of_fast = (
        0.3
        if VALVE.velocities(SETTINGS, NOMINAL)[0] > BORE.velocities(SETTINGS, NOMINAL)[0]
        else 0.7
    )
    expected = slow + weight_of_fast * (fast - slow)
    assert drawn.mean() == pytest.approx(expected, abs=0.003)
    variance = 0.02**2 + weight_of_fast * (1 - weight_of_fast) * (fast - slow) ** 2
    assert drawn.var() == pytest.approx(variance, rel=0.08)


def test_guns_that_keep_the_bullet_count_for_leaving_alone() -> None:
    mean = AveragedGunStage.of([(0.4, STUCK), (0.6, BORE)])
    low = [setting(tank_pressure_pa=2e5)]
    assert STUCK.velocities(low, NOMINAL) == 0
    np.testing.assert_allclose(mean.velocities(low, NOMINAL), BORE.velocities(low, NOMINAL))
    np.testing.assert_allclose(mean.leaving(low, NOMINAL), 0.6)
    stuck_guns = AveragedGunStage.of([(0.5, STUCK), (0.5, STUCK)])
    assert stuck_guns.velocities(low, NOMINAL) == 0


def test_measured_shots_teach_every_gun() -> None:
    open_guns = [
        (0.5, GunStage(BENCH, 0.05, gun.effects, unknown_effects=True)) for gun in (VALVE, BORE)
    ]  # fmt: skip
    pressure, mass = np.array([2e5, 3e5, 5e5]), np.full(3, 0.5)
    measured = VALVE.fired(pressure, mass)
    taught = AveragedGunStage.of(open_guns).updated(pressure, mass, measured, 0.01 * measured)
    assert (
        isinstance(taught, AveragedGunStage) and taught.shots is not None and len(taught.shots) == 3
    )
    assert all(gun.shots is not None for _, gun in taught.guns)
    np.testing.assert_allclose(
        taught.velocities(SETTINGS, NOMINAL), VALVE.velocities(SETTINGS, NOMINAL), rtol=0.03
    )
    assert "3 measured shots + mean of" in taught.label


@pytest.mark.parametrize(
    "guns", [[], [(1.0, VALVE)], [(0.5, VALVE), (0.6, BORE)], [(1.0, VALVE), (0.0, BORE)]]
)
def test_weights_are_of_two_or_more_and_sum_to_one(guns: list[tuple[float, GunStage]]) -> None:
    with pytest.raises(ValueError, match="expected two or more"):
        AveragedGunStage.of(guns)


def test_twin_predicts_with_the_mean() -> None:
    mean = AveragedGunStage.of([(0.5, VALVE), (0.5, BORE)])
    plate = PlateStage({"aluminum": ringing_plate()}, spread=PlateSpread(0.0, 0.0, 0))
    twin = pickle.loads(pickle.dumps(Twin(HalfSine(), mean, plate, samples=2000)))
    shot = twin.predict(SETTINGS[1], draws=64)
    parts = [gun.velocities(SETTINGS[1:], NOMINAL)[0] for gun in (VALVE, BORE)]
    assert shot.velocity_m_s.mean == pytest.approx(np.mean(parts), rel=0.02)
    low, high = shot.velocity_m_s.ci90
    assert low < min(parts) * 1.01 and high > max(parts) * 0.99
    assert shot.models["gun"].endswith("mean of gun.valve_flow and gun.barrel_loss")
