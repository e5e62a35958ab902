"""The habits of both benches: when a hand strikes, what a gun's operator sets, and how its parts read."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.virtualbench.campaigns import gun, hammer
from pyroshock.virtualbench.campaigns.base import cells_of, day_fraction
from pyroshock.virtualbench.campaigns.gun import ARRAY_SHARES, LASER, SENSORS, TANK
from pyroshock.virtualbench.effects import Effects
from pyroshock.virtualbench.sensors.chain import calibrated, written
from support.records.bench_shots import shot

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
    """Transducer 5 % too sensitive and 5 kPa too high: the true pressure is lower, the reading is the plan's."""
    effects = Effects.only("sensor.pressure_gain", 10.0).with_strength("sensor.pressure_offset", 10.0)
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
        for effect in (("sensor.velocity_gain", 0.0), ("sensor.velocity_gain", 4.0), ("bench.trigger_jitter", 5.0))
    )
    assert still.truths[0]["bullet_length_m"] == gun.BULLET_LENGTH_M
    assert gun.BULLET_LENGTH_M / faulty.truths[0]["bullet_length_m"] == pytest.approx(1.02)
    shift = moved.truths[0]["start_s"] - still.truths[0]["start_s"]
    assert abs(shift) > 1e-4
    edges = [np.argmax(calibrated(taken.channels["laser"], LASER) < 0.1) / gun.RATE_HZ for taken in (still, moved)]
    assert edges[1] - edges[0] == pytest.approx(shift, abs=2e-5)


def test_array_carries_the_whole_force():
    assert sum(ARRAY_SHARES) == pytest.approx(1.0)
    taken = shot(Effects.none())
    total = sum(calibrated(taken.channels[s.name], s) for s in SENSORS if s.quantity == "force")
    impulse = total.sum() / gun.RATE_HZ
    assert impulse == pytest.approx(taken.truths[0]["impulse_n_s"], rel=2e-3)


def test_shot_that_does_not_leave_records_no_impact():
    taken = shot(Effects.default(), tank_pressure_bar="0.05", bullet_mass_kg="1")
    assert taken.truths[0]["velocity_m_s"] == 0.0
    assert "contact_time_s" not in taken.truths[0]
    assert np.abs(calibrated(taken.channels["force_1"], SENSORS[4])).max() < 100
