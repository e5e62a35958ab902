"""The two signals of a shot, measured again by the ingest's own rules; the cubic between a shot's
points."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.ingest.extraction.pressure_drop import pressure_drop
from pyroshock.ingest.extraction.velocity import muzzle_velocity
from pyroshock.virtualbench.effects import Effects
from pyroshock.virtualbench.gun.build import GunBuild, Projectile
from pyroshock.virtualbench.gun.fire import (
    BEAM_WIDTH_M,
    LASER_REST_M,
    ShotTruth,
    Trigger,
    crossings,
    fire,
    position_at,
    shot_signals,
    trigger_time_s,
    velocity_at,
)
from scipy.special import ndtr

RATE_HZ = 25_000.0
BULLET = Projectile()


@pytest.fixture(scope="module", params=[2.5e4, 1e5, 6e5])
def shot(request: pytest.FixtureRequest) -> ShotTruth:
    return fire(GunBuild(), Effects.default(), request.param, BULLET, np.random.default_rng(1))


@pytest.fixture(scope="module")
def signals(shot: ShotTruth) -> dict[str, np.ndarray]:
    return shot_signals(shot, BULLET, RATE_HZ, 0.9, Trigger(pre_trigger_s=0.2))


def test_velocity_pressure_and_edges_come_back(
    shot: ShotTruth, signals: dict[str, np.ndarray]
) -> None:
    """Velocity within its uncertainty, edges between samples; the grid begins before the
    trigger."""
    velocity = muzzle_velocity(signals["laser"], RATE_HZ, BULLET.length_m)
    assert abs(velocity.velocity_m_s - shot.muzzle_velocity_m_s) < velocity.velocity_u_m_s
    begin = trigger_time_s(shot) - 0.2
    edges_s = begin + np.array([velocity.enter_sample, velocity.leave_sample]) / RATE_HZ
    assert edges_s == pytest.approx(shot.laser_blocked[0], abs=0.6 / RATE_HZ)
    pressure = pressure_drop(signals["tank_pressure"], RATE_HZ).pressure_pa
    assert pressure == pytest.approx(shot.tank_pressure_pa[0], rel=1e-3)
    assert signals["laser"].max() == pytest.approx(LASER_REST_M)
    assert signals["laser"].min() == pytest.approx(LASER_REST_M - BULLET.diameter_m)
    assert {signal.shape for signal in signals.values()} == {(22_500,)}
    assert signals["tank_pressure"][int(0.2 * RATE_HZ)] == pytest.approx(
        0.95 * shot.tank_pressure_pa[0], rel=1e-6
    )
    late = shot_signals(
        shot, BULLET, RATE_HZ, 0.9, Trigger(pre_trigger_s=0.2), trigger_offset_s=10 / RATE_HZ
    )
    assert late["laser"][:-10] == pytest.approx(signals["laser"][10:], abs=1e-9)


@pytest.mark.parametrize("pressure_pa", [4e4, 6e5])
def test_laser_is_that_of_a_beam_followed_at_every_moment(pressure_pa: float) -> None:
    shot = fire(GunBuild(), Effects.default(), pressure_pa, BULLET, np.random.default_rng(1))
    laser = shot_signals(shot, BULLET, 4e5, 0.9, Trigger(pre_trigger_s=0.2))["laser"]
    moment = trigger_time_s(shot) - 0.2 + np.arange(laser.size) / 4e5
    tail = position_at(shot.time_s, shot.position_m, shot.velocity_m_s, moment)
    past = (tail - shot.laser_position_m) / (BEAM_WIDTH_M / 4)
    blocked = ndtr(past + BULLET.length_m / (BEAM_WIDTH_M / 4)) - ndtr(past)
    assert blocked.max() > 0.1
    expected = LASER_REST_M - BULLET.diameter_m * blocked
    np.testing.assert_allclose(laser, expected, rtol=0, atol=1e-17)


def test_rebound_is_a_second_slower_passage() -> None:
    shot = fire(
        GunBuild(), Effects.default(), 4e4, BULLET, np.random.default_rng(1), restitution=0.5
    )
    laser = shot_signals(shot, BULLET, RATE_HZ, 0.9, Trigger(pre_trigger_s=0.2))["laser"]
    blocked = (laser < LASER_REST_M - BULLET.diameter_m / 2).astype(int)
    starts, stops = np.flatnonzero(np.diff(blocked) == 1), np.flatnonzero(np.diff(blocked) == -1)
    assert len(starts) == len(stops) == len(shot.laser_blocked) >= 2
    assert stops[1] - starts[1] > 1.5 * (stops[0] - starts[0])


def test_record_begins_by_the_share_that_triggers_or_before_the_valve_turns(
    shot: ShotTruth,
) -> None:
    tank = shot_signals(shot, BULLET, RATE_HZ, 0.9, Trigger(0.2, 0.1))["tank_pressure"]
    assert tank[int(0.1 * RATE_HZ)] == pytest.approx(0.8 * shot.tank_pressure_pa[0], rel=1e-6)
    tank = shot_signals(shot, BULLET, RATE_HZ, 0.9, Trigger(None, 0.25))["tank_pressure"]
    port = int((0.25 + shot.port_opens_s) * RATE_HZ)
    assert np.ptp(tank[: port - 1]) < 1.0
    assert tank[port + int(0.02 * RATE_HZ)] < tank[0] - 50.0


def test_impossible_trigger_and_recording_are_refused(shot: ShotTruth) -> None:
    for setting in ({"share": 0.0}, {"share": 1.0}, {"pre_trigger_s": -0.1}):
        with pytest.raises(ValueError, match="trigger: "):
            Trigger(**setting)
    for rate_hz, duration_s, trigger, words in (
        (0.0, 0.9, Trigger(pre_trigger_s=0.2), "sampling_rate_hz"),
        (RATE_HZ, -1.0, Trigger(), "duration_s"),
        (RATE_HZ, 0.9, Trigger(pre_trigger_s=0.9), "pre_trigger_s"),
        (RATE_HZ, 3.0, Trigger(pre_trigger_s=0.2), "until_s"),
    ):
        with pytest.raises(ValueError, match=words):
            shot_signals(shot, BULLET, rate_hz, duration_s, trigger)
    quiet = fire(GunBuild(), Effects.default(), 0.0, BULLET, np.random.default_rng(1), until_s=0.3)
    with pytest.raises(ValueError, match="no trigger"):
        shot_signals(quiet, BULLET, RATE_HZ, 0.9, Trigger(pre_trigger_s=0.2))


TIME = np.array([0.0, 0.3, 0.45, 1.0, 1.4])
WAY = TIME, TIME**3 - TIME, 3 * TIME**2 - 1


def test_cubic_motion_is_exact_and_another_converges_with_the_fourth_order() -> None:
    moment = np.linspace(0, 1.4, 57)
    assert position_at(*WAY, moment) == pytest.approx(moment**3 - moment, abs=1e-14)
    assert velocity_at(*WAY, moment) == pytest.approx(3 * moment**2 - 1, abs=1e-13)
    assert position_at(*WAY, np.array([-1.0, 9.0])) == pytest.approx([0.0, 1.4**3 - 1.4])
    roots = np.roots([1, 0, -1, 0.2])
    assert crossings(*WAY, -0.2) == pytest.approx(np.sort(roots[roots > 0]), abs=1e-12)
    assert position_at(*WAY, crossings(*WAY, 0.7)) == pytest.approx([0.7], abs=1e-12)
    assert crossings(*WAY, 5.0).size == 0

    def error(points: int) -> float:
        time = np.linspace(0, 1, points)
        moment = np.linspace(0, 1, 997)
        return float(
            np.abs(
                position_at(time, np.sin(6 * time), 6 * np.cos(6 * time), moment)
                - np.sin(6 * moment)
            ).max()
        )

    assert np.log2(error(21) / error(41)) == pytest.approx(4, abs=0.1)
