"""The two signals of a shot, measured again by the ingest's own rules."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.ingest.velocity import muzzle_velocity, tank_pressure_before
from pyroshock.virtualbench.effects import Effects
from pyroshock.virtualbench.gun.build import GunBuild, Projectile
from pyroshock.virtualbench.gun.fire import (
    LASER_REST_M,
    ShotTruth,
    Trigger,
    fire,
    shot_signals,
    trigger_time_s,
)

RATE_HZ = 25_000.0
BULLET = Projectile()


@pytest.fixture(scope="module", params=[2.5e4, 1e5, 6e5])
def shot(request: pytest.FixtureRequest) -> ShotTruth:
    return fire(GunBuild(), Effects.default(), request.param, BULLET, np.random.default_rng(1))


@pytest.fixture(scope="module")
def signals(shot: ShotTruth) -> dict[str, np.ndarray]:
    return shot_signals(shot, BULLET, RATE_HZ, 0.9, Trigger(pre_trigger_s=0.2))


def test_velocity_comes_back_within_its_uncertainty(shot: ShotTruth, signals: dict[str, np.ndarray]) -> None:
    measured = muzzle_velocity(signals["laser"], RATE_HZ, BULLET.length_m)
    assert abs(measured.velocity_m_s - shot.muzzle_velocity_m_s) < measured.velocity_u_m_s


def test_edges_come_back_between_samples(shot: ShotTruth, signals: dict[str, np.ndarray]) -> None:
    measured = muzzle_velocity(signals["laser"], RATE_HZ, BULLET.length_m)
    begin = trigger_time_s(shot) - 0.2
    found = begin + np.array([measured.enter_sample, measured.leave_sample]) / RATE_HZ
    assert found == pytest.approx(shot.laser_blocked[0], abs=0.6 / RATE_HZ)


def test_tank_pressure_comes_back(shot: ShotTruth, signals: dict[str, np.ndarray]) -> None:
    measured = tank_pressure_before(signals["tank_pressure"])
    assert measured.pressure_pa == pytest.approx(shot.tank_pressure_pa[0], rel=1e-3)


def test_laser_falls_by_the_diameter(signals: dict[str, np.ndarray]) -> None:
    assert signals["laser"].max() == pytest.approx(LASER_REST_M)
    assert signals["laser"].min() == pytest.approx(LASER_REST_M - BULLET.diameter_m)


def test_rebound_is_a_second_slower_passage() -> None:
    shot = fire(GunBuild(), Effects.default(), 4e4, BULLET, np.random.default_rng(1), restitution=0.5)
    laser = shot_signals(shot, BULLET, RATE_HZ, 0.9, Trigger(pre_trigger_s=0.2))["laser"]
    blocked = (laser < LASER_REST_M - BULLET.diameter_m / 2).astype(int)
    starts, stops = np.flatnonzero(np.diff(blocked) == 1), np.flatnonzero(np.diff(blocked) == -1)
    assert len(starts) == len(stops) == len(shot.laser_blocked) >= 2
    assert stops[1] - starts[1] > 1.5 * (stops[0] - starts[0])


def test_grid_begins_before_the_trigger(shot: ShotTruth, signals: dict[str, np.ndarray]) -> None:
    assert {signal.shape for signal in signals.values()} == {(22_500,)}
    trigger = int(0.2 * RATE_HZ)
    assert signals["tank_pressure"][trigger] == pytest.approx(0.95 * shot.tank_pressure_pa[0], rel=1e-6)


def test_another_share_triggers_where_that_share_is_lost(shot: ShotTruth) -> None:
    tank = shot_signals(shot, BULLET, RATE_HZ, 0.9, Trigger(0.2, 0.1))["tank_pressure"]
    assert tank[int(0.1 * RATE_HZ)] == pytest.approx(0.8 * shot.tank_pressure_pa[0], rel=1e-6)


def test_without_a_trigger_the_record_begins_before_the_valve_turns(shot: ShotTruth) -> None:
    tank = shot_signals(shot, BULLET, RATE_HZ, 0.9, Trigger(None, 0.25))["tank_pressure"]
    port = int((0.25 + shot.port_opens_s) * RATE_HZ)
    assert np.ptp(tank[: port - 1]) < 1.0
    assert tank[port + int(0.02 * RATE_HZ)] < tank[0] - 50.0


@pytest.mark.parametrize("trigger", [{"share": 0.0}, {"share": 1.0}, {"pre_trigger_s": -0.1}])
def test_trigger_that_no_recorder_has_is_refused(trigger: dict[str, float]) -> None:
    with pytest.raises(ValueError, match="trigger: "):
        Trigger(**trigger)


def test_offset_shifts_the_recording(shot: ShotTruth, signals: dict[str, np.ndarray]) -> None:
    late = shot_signals(shot, BULLET, RATE_HZ, 0.9, Trigger(pre_trigger_s=0.2), trigger_offset_s=10 / RATE_HZ)
    assert late["laser"][:-10] == pytest.approx(signals["laser"][10:], abs=1e-9)


def test_shot_that_never_falls_does_not_trigger() -> None:
    quiet = fire(GunBuild(), Effects.default(), 0.0, BULLET, np.random.default_rng(1), until_s=0.3)
    with pytest.raises(ValueError, match="no trigger"):
        shot_signals(quiet, BULLET, RATE_HZ, 0.9, Trigger(pre_trigger_s=0.2))


@pytest.mark.parametrize(
    ("given", "name"),
    [
        ((0.0, 0.9, Trigger(pre_trigger_s=0.2)), "sampling_rate_hz"),
        ((RATE_HZ, -1.0, Trigger()), "duration_s"),
        ((RATE_HZ, 0.9, Trigger(pre_trigger_s=0.9)), "pre_trigger_s"),
    ],
)
def test_impossible_recording_is_refused(shot: ShotTruth, given: tuple[float, float, float], name: str) -> None:
    with pytest.raises(ValueError, match=name):
        shot_signals(shot, BULLET, *given)


def test_recording_past_the_end_asks_for_a_longer_shot(shot: ShotTruth) -> None:
    with pytest.raises(ValueError, match="until_s"):
        shot_signals(shot, BULLET, RATE_HZ, 3.0, Trigger(pre_trigger_s=0.2))
