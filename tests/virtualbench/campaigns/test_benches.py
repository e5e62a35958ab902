"""The habits of both benches, and the optional columns of the gun."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pyroshock.virtualbench.campaigns import gun, hammer
from pyroshock.virtualbench.campaigns.base import cells_of, day_fraction
from pyroshock.virtualbench.campaigns.gun import ARRAY_SHARES, LASER, POSITIONS, SENSORS, TANK
from pyroshock.virtualbench.effects import Effects
from pyroshock.virtualbench.gun.build import Projectile
from pyroshock.virtualbench.gun.fire import Trigger, fire, shot_signals
from pyroshock.virtualbench.sensors.chain import analog, calibrated, written
from support.records.bench_shots import GUN_ROW, shot

pytestmark = pytest.mark.usefixtures("coarse_plates")


@pytest.mark.parametrize("seed", range(20))
def test_ten_hits_in_ten_seconds_stay_apart(seed):
    starts, duration = hammer.moments(10, np.random.default_rng(seed))
    assert 9.5 < duration < 10.5
    assert 0.3 < starts[0] < 1.0
    assert duration - starts[-1] > 0.5
    assert np.diff(starts).min() > 0.5


def test_days_begin_in_the_morning_and_a_plan_s_bookkeeping_gives_way():
    assert [day_fraction(i, 4) for i in range(6)] == [0.0, 0.25, 0.5, 0.75, 0.0, 0.25]
    assert cells_of({"order": "9", "repetition": "5", "run": "2", "recording": "x"}, 1) == {
        "run": "2",
        "repetition": "1",
        "order": "9",
    }


def test_operator_sets_what_the_transducer_reads():
    """Transducer 5 % too sensitive and 5 kPa too high: the true pressure is lower, the reading is
    the plan's."""
    effects = Effects.only("sensor.pressure_gain", 10.0).with_strength(
        "sensor.pressure_offset", 10.0
    )
    taken = shot(effects)
    assert taken.truths[0]["tank_pressure_pa"] == pytest.approx((1.5e5 - 5e3) / 1.05)
    reading = calibrated(taken.channels["tank_pressure"], TANK)[:1000].mean()
    assert reading == pytest.approx(1.5e5, abs=100)
    ends = written(np.array([0.080, 0.130, 0.180]), LASER)
    assert ends == pytest.approx([-5.0, 0.0, 5.0])


def test_shorter_bullet_reads_too_fast_and_trigger_jitter_moves_the_recording():
    """The lab divides the length it believes in by the transit of the true one."""
    still, faulty, moved = (
        shot(Effects.only(*effect))
        for effect in (
            ("sensor.velocity_gain", 0.0),
            ("sensor.velocity_gain", 4.0),
            ("bench.trigger_jitter", 5.0),
        )
    )
    assert still.truths[0]["bullet_length_m"] == gun.BULLET_LENGTH_M
    assert gun.BULLET_LENGTH_M / faulty.truths[0]["bullet_length_m"] == pytest.approx(1.02)
    shift = moved.truths[0]["start_s"] - still.truths[0]["start_s"]
    assert abs(shift) > 1e-4
    edges = [
        np.argmax(calibrated(taken.channels["laser"], LASER) < 0.1) / gun.RATE_HZ
        for taken in (still, moved)
    ]
    assert edges[1] - edges[0] == pytest.approx(shift, abs=2e-5)


@pytest.mark.parametrize("pressure_pa", [2.5e4, 4e4, 6e5])
def test_laser_of_passages_alone_is_that_of_the_whole_recording(pressure_pa):
    """Also of one that passes twice."""
    bullet = Projectile()
    bench = gun.VirtualGunBench(Effects.default(), {})
    fired = fire(bench.gun, bench.effects, pressure_pa, bullet, np.random.default_rng(1))
    bench = replace(bench, trigger=Trigger(pre_trigger_s=0.4))
    rate_hz = gun.RATE_HZ * gun.SLOW_RATIO
    whole_laser = shot_signals(fired, bullet, rate_hz, gun.DURATION_S, bench.trigger)["laser"]
    time = np.arange(whole_laser.size) / rate_hz
    expected = analog(time, whole_laser, LASER, gun.RATE_HZ, bench.effects)
    assert np.ptp(expected) > 0.04
    laser = bench._slow(fired, bullet, 0.0)["laser"]
    np.testing.assert_allclose(laser, expected, rtol=0, atol=1e-14)


def test_array_carries_the_whole_force_and_a_shot_that_stays_records_no_impact():
    assert sum(ARRAY_SHARES) == pytest.approx(1.0)
    taken = shot(Effects.none())
    total = sum(calibrated(taken.channels[s.name], s) for s in SENSORS if s.quantity == "force")
    impulse = total.sum() / gun.RATE_HZ
    assert impulse == pytest.approx(taken.truths[0]["impulse_n_s"], rel=2e-3)
    taken = shot(Effects.default(), tank_pressure_bar="0.05", bullet_mass_kg="1")
    assert taken.truths[0]["velocity_m_s"] == 0.0
    assert "contact_time_s" not in taken.truths[0]
    assert np.abs(calibrated(taken.channels["force_1"], SENSORS[4])).max() < 100


def test_another_height_shakes_the_plate_otherwise_and_leaves_gun_and_force_alone():
    here, same, there = (
        shot(Effects.default(), chain_height_mm=text).channels for text in ("", "0", "112")
    )
    for name in here:
        assert np.array_equal(here[name], same[name])
        assert np.array_equal(here[name], there[name]) is not name.startswith("acceleration")


def test_shapes_of_the_struck_point_are_those_below_it():
    bench = gun.set_up(
        [GUN_ROW, {**GUN_ROW, "chain_height_mm": "56"}], Effects.none(), np.random.default_rng(0)
    )
    (plate,) = bench.plates.values()
    usual, lower = plate.shape_impact[: len(POSITIONS)], plate.shape_impact[len(POSITIONS) :]
    assert usual.shape == lower.shape
    assert bench.heights_m == (0.0, pytest.approx(0.056))
    rigid = np.flatnonzero(plate.frequencies_hz < 1.0)
    assert rigid.size >= 3
    # Rigid modes are planes: 56 mm lower they differ by the slope that two other points have
    # between them.
    points = np.array([[0.47, 0.28], [0.31, 0.37], [0.68, 0.22]])
    planes = np.linalg.solve(np.column_stack([points, np.ones(3)]), usual[:, rigid])
    np.testing.assert_allclose(
        usual[:, rigid] - lower[:, rigid], np.tile(0.056 * planes[1], (3, 1)), atol=1e-6
    )


@pytest.mark.parametrize(
    ("text", "words"), [("50", "expected a multiple of 56"), ("560", "the bullet misses")]
)
def test_a_height_that_the_chains_do_not_have_is_refused(text, words):
    with pytest.raises(ValueError, match=rf"run 3: chain_height_mm is '{text}'.*{words}"):
        gun.set_up([{**GUN_ROW, "chain_height_mm": text}], Effects.none(), np.random.default_rng(0))


def test_another_point_shakes_the_plate_otherwise_and_the_first_is_the_default():
    """`impact_position`: gun and force are left alone, and without it the bench is as it was."""
    usual, first, empty, second = (
        shot(Effects.default(), **row).channels
        for row in ({}, *({"impact_position": p} for p in ("#1", "", "#2")))
    )
    for name in usual:
        assert np.array_equal(usual[name], first[name]) and np.array_equal(usual[name], empty[name])
        assert np.array_equal(usual[name], second[name]) is not name.startswith("acceleration")
    with pytest.raises(
        ValueError, match=r"run 3: impact_position is '#4'; expected one of #1, #2, #3"
    ):
        gun.set_up([{**GUN_ROW, "impact_position": "#4"}], Effects.none(), np.random.default_rng(0))


def test_a_valve_that_closes_leaves_pressure_in_the_recorded_tank():
    # `valve_profile`: the way of the valve of each shot
    open_, closing = (
        shot(Effects.default(), **row) for row in ({}, {"valve_profile": "0:0 0.25:1 0.3:1 0.35:0"})
    )
    bar = [(take.channels["tank_pressure"] - 0.3624) / 0.5621 for take in (open_, closing)]
    end = slice(-1000, None)
    assert bar[1][end].mean() > bar[0][end].mean() + 0.05
    assert bar[1][:1000].mean() == pytest.approx(bar[0][:1000].mean(), abs=0.005)
    with pytest.raises(
        ValueError, match=r"run 3: valve_profile is '0-1'; expected points TIME:POSITION"
    ):
        gun.set_up([{**GUN_ROW, "valve_profile": "0-1"}], Effects.none(), np.random.default_rng(0))
