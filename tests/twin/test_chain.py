"""The chain as one: stages meet, bands come from what is spread, measured interfaces stand in."""

from __future__ import annotations

import json
import math
import pickle
from dataclasses import replace

import numpy as np
import pytest
from pyroshock.twin.chain import Twin
from pyroshock.twin.contact_interface import ForcePulses, ImpactBatch
from pyroshock.twin.effects import effect
from pyroshock.twin.gun.nominal import muzzle_velocity
from pyroshock.twin.gun.stage import GunStage
from pyroshock.twin.plate.stage import PlateSpread, PlateStage
from pyroshock.twin.prediction import Band, Quantity, stratified_normals
from pyroshock.twin.sensors.chain import SensorChain
from pyroshock.twin.sensors.measured_pulses import MeasuredForce, sampled
from support.records.twin_parts import BENCH, HalfSine, rigid_plate, ringing_plate, setting

#: What nobody doubts.
SURE = PlateSpread(0.0, 0.0, 0)


def twin(**own):  # a factory of this file
    given = {
        "contact": HalfSine(),
        "gun": GunStage(BENCH, 0.05),
        "plate": PlateStage({"aluminum": ringing_plate()}, spread=SURE),
        "samples": 4_000,
    }
    return Twin(**given | own)


def rng(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


def test_velocity_is_the_guns_at_the_true_pressure_or_the_given_one():
    shot = twin().predict(setting(tank_pressure_pa=5e5), draws=0)
    assert shot.velocity_m_s.mean == pytest.approx(
        float(muzzle_velocity(BENCH, 5e5, 0.5)), rel=1e-12
    )
    low = twin(sensors=SensorChain.of([effect("sensor.pressure_gain", gain=1.25)]))
    shot = low.predict(setting(tank_pressure_pa=5e5), draws=0)
    assert shot.velocity_m_s.mean == pytest.approx(float(muzzle_velocity(BENCH, 4e5, 0.5)))
    slowest, fastest = twin().predict(setting(), draws=8).velocity_m_s.ci90
    assert slowest == fastest == 8.0


def test_rigid_plate_moves_as_newton_says_with_the_spectrum_of_a_half_sine():
    """A base pulse of half a sine, T = 0.4 ms, Q = 10: 1.65 times its peak at f T = 0.8 (as 80 Hz
    of 11 ms nearly)."""
    plates = PlateStage({"aluminum": rigid_plate(8.0)}, spread=SURE)
    shot = twin(plate=plates, frequency_hz=np.array([2200.0])).predict(setting(), draws=0)
    peak = shot.peak_force_n.mean / 8.0
    assert shot.peak_acceleration_m_s2("a1").mean == pytest.approx(peak, rel=2e-3)
    end_velocity = shot.accelerations_m_s2[0, 0].sum() / shot.sampling_rate_hz
    assert end_velocity == pytest.approx(2 * 0.5 * 8.0 / 8.0, rel=1e-4)
    assert shot.spectra_m_s2["a1"].mean[0] == pytest.approx(82.4137 / 50 * peak, rel=0.01)


def test_twice_the_velocity_is_twice_the_spectrum_and_positions_choose_their_shapes():
    slow, fast = twin().spectra([setting(impact_velocity_m_s=u) for u in (4.0, 8.0)])
    np.testing.assert_allclose(fast, 2 * slow, rtol=1e-12)
    model, plate = twin(), ringing_plate()
    swapped = replace(plate, shape_impact=plate.shape_impact[::-1], shapes=plate.shapes[::-1])
    other = twin(plate=PlateStage({"aluminum": swapped}, spread=SURE))
    one = model.spectra([setting(impact_position="#2")], "a2")
    np.testing.assert_allclose(one, other.spectra([setting(impact_position="#1")], "a1"), rtol=1e-9)


def test_effects_reach_their_stages():
    damped = PlateStage({"aluminum": ringing_plate()}, (effect("plate.damping", factor=5.0),), SURE)
    gained = SensorChain.of(
        [effect("sensor.acceleration_gain", gain=2.0), effect("sensor.velocity_gain", gain=1.1)]
    )
    nominal = twin().predict(setting(), draws=0)
    changed = twin(plate=damped, sensors=gained).predict(setting(), draws=0)
    assert changed.velocity_m_s.mean == pytest.approx(1.1 * 8.0)
    assert np.all(changed.spectra_m_s2["a1"].mean < 2 * nominal.spectra_m_s2["a1"].mean)
    assert (
        "plate.damping" in changed.models["plate"]
        and "sensor.velocity_gain" in changed.models["sensors"]
    )


def test_measured_shots_correct_the_gun_and_say_its_spread():
    """Shots of a tenth less than predicted, the same at every setting: the twin learns just
    that."""
    pressure = np.repeat([2e5, 4e5, 6e5, 8e5], 3)
    mass = np.full(12, 0.5)
    scatter = np.tile(np.exp([0.02, 0.0, -0.02]), 4)
    predicted = muzzle_velocity(BENCH, pressure, mass)
    learned = GunStage(BENCH, 0.5).updated(pressure, mass, 0.9 * predicted * scatter)
    shot = twin(gun=learned).predict(setting(tank_pressure_pa=5e5))
    assert shot.velocity_m_s.mean == pytest.approx(
        0.9 * float(muzzle_velocity(BENCH, 5e5, 0.5)), rel=0.01
    )
    low, high = shot.velocity_m_s.ci90
    assert 0.01 < math.log(high / low) / 3.29 < 0.04
    assert "12 measured shots" in shot.models["gun"]


def test_batches_and_chunks_are_the_single_shots():
    model = twin()
    many = [
        setting(tank_pressure_pa=p, impact_position=i)
        for p in (2e5, 4e5, 6e5)
        for i in ("#1", "#2")
    ]
    batch = model.spectra(many)
    for each, row in zip(many, batch, strict=True):
        np.testing.assert_allclose(
            model.predict(each, draws=0).spectra_m_s2["a1"].mean, row, rtol=1e-9
        )
    model = twin(samples=400, frequency_hz=np.array([2000.0, 5000.0]))
    many = [setting(impact_velocity_m_s=u) for u in np.linspace(1, 20, 300)]
    np.testing.assert_allclose(model.spectra(many)[::-1], model.spectra(many[::-1]), rtol=1e-9)


def test_draws_of_settings_share_their_luck_and_are_those_of_the_prediction():
    model = twin(contact=HalfSine(scatter=0.0))
    drawn = model.draws([setting(impact_velocity_m_s=u) for u in (4.0, 8.0)], 5, rng())
    assert drawn.shape == (5, 2, model.frequency_hz.size)
    np.testing.assert_allclose(drawn[:, 1], 2 * drawn[:, 0], rtol=1e-9)
    model, one = twin(), setting(tank_pressure_pa=4e5)
    drawn = model.draws([one], 16, rng(7))[:, 0]
    shot = model.predict(one, draws=16, rng=rng(7))
    np.testing.assert_allclose(shot.spectra_m_s2["a1"].mean, drawn.mean(axis=0), rtol=1e-9)


def test_bands_are_those_of_the_draws_and_log_normal_for_the_velocity():
    shot, again = (twin().predict(setting(tank_pressure_pa=5e5), rng=rng()) for _ in range(2))
    np.testing.assert_array_equal(shot.spectra_m_s2["a2"].upper, again.spectra_m_s2["a2"].upper)
    low, high = shot.velocity_m_s.ci90
    assert math.log(high / low) == pytest.approx(2 * 1.645 * 0.05, rel=0.03)
    for name in ("velocity_m_s", "contact_time_s", "peak_force_n", "impulse_n_s"):
        assert Quantity.of(getattr(shot.draws, name)) == getattr(shot, name)
    assert Quantity.of(shot.draws.peak_acceleration_m_s2[:, 1]) == shot.peak_acceleration_m_s2("a2")
    np.testing.assert_array_equal(
        Band.of(shot.draws.spectra_m_s2[:, 0]).upper, shot.spectra_m_s2["a1"].upper
    )


@pytest.mark.parametrize(
    "own",
    [
        {"gun": GunStage(BENCH, 0.1)},
        {"contact": HalfSine(scatter=0.3)},
        {"plate": PlateStage({"aluminum": ringing_plate()}, spread=PlateSpread(0.02, 0.5, 8))},
    ],
    ids=("gun", "contact", "plate"),
)
def test_a_sure_twin_has_no_bands_and_every_stage_widens_them(own):
    sure = {"gun": GunStage(BENCH, 0.0), "contact": HalfSine(scatter=0.0)}
    narrow, wide = (
        twin(**given).predict(setting(tank_pressure_pa=5e5), draws=32, rng=rng()).spectra_m_s2["a1"]
        for given in (sure, sure | own)
    )
    np.testing.assert_allclose(narrow.upper, narrow.lower, rtol=1e-9)
    assert np.median(wide.upper / wide.lower) > 1.1


def test_band_holds_nine_shots_of_ten():
    model, one = twin(), setting(tank_pressure_pa=5e5)
    band = model.predict(one, draws=64, rng=rng()).spectra_m_s2["a1"]
    other = model.draws([one], 400, rng(99))[:, 0]
    inside = np.mean((other >= band.lower) & (other <= band.upper))
    assert 0.85 < inside < 0.95


def test_stratified_normals_are_standard_and_quantiles_those_of_draws():
    z = stratified_normals(64, 3, rng())
    np.testing.assert_allclose(z.mean(axis=0), 0, atol=1e-12)
    np.testing.assert_allclose(z.std(axis=0), 1, atol=0.03)
    assert np.all(np.abs(np.corrcoef(z.T) - np.eye(3)) < 0.35)
    draws = np.arange(101.0)
    assert Quantity.of(draws).mean == 50.0
    assert Quantity.of(draws).ci90 == pytest.approx((4.55, 95.45))
    band = Band.of(np.column_stack([draws, -draws]))
    np.testing.assert_allclose((band.lower, band.upper), ([4.55, -95.45], [95.45, -4.55]))


def test_measured_velocity_stands_in_for_the_gun_and_measured_force_for_the_contact_as_well():
    model = twin()
    fired = model.predict(setting(tank_pressure_pa=5e5), draws=0)
    given = model.predict(setting(impact_velocity_m_s=fired.velocity_m_s.mean), draws=0)
    np.testing.assert_allclose(
        given.spectra_m_s2["a1"].mean, fired.spectra_m_s2["a1"].mean, rtol=1e-9
    )
    expected = model.predict(setting(), draws=0)
    pulse = HalfSine().pulses(ImpactBatch([setting()], np.array([8.0])))
    shot = model.predict(
        setting(), draws=8, measured_force=MeasuredForce(sampled(pulse, 1e-6)[0], 1e6)
    )
    np.testing.assert_allclose(
        shot.spectra_m_s2["a1"].mean, expected.spectra_m_s2["a1"].mean, rtol=0.01
    )
    assert shot.impulse_n_s.mean == pytest.approx(expected.impulse_n_s.mean, rel=1e-3)
    assert shot.models["contact"] == "measured force"


def test_twin_without_a_plate_tells_the_force_and_pickles_and_json_read_back():
    shot = twin(plate=PlateStage({})).predict(setting(), draws=4)
    assert shot.sensors == () and shot.as_json()["srs"] is None
    with pytest.raises(ValueError, match="has no plate"):
        twin(plate=PlateStage({})).spectra([setting()])
    with pytest.raises(TypeError, match=r"sensor\.force_gain does not act here"):
        PlateStage({"aluminum": ringing_plate()}, (effect("sensor.force_gain"),))
    found = json.loads(
        json.dumps(twin().predict(setting(impact_velocity_m_s=40.0), draws=4).as_json())
    )
    contract = {
        "velocity_m_s",
        "contact_time_s",
        "peak_force_n",
        "force",
        "srs",
        "models",
        "outside_domain",
    }
    assert contract <= found.keys()
    assert found["velocity_m_s"].keys() == {"mean", "ci90"}
    assert found["force"].keys() == {"time_s", "mean", "lower", "upper"}
    assert found["srs"]["unit"] == "m/s2" and found["srs"]["a2"].keys() == {
        "mean",
        "lower",
        "upper",
    }
    assert found["outside_domain"] == [
        {"predictor": "impact_velocity", "value": 40.0, "range": "0 to 30"}
    ]
    model = twin()
    again = pickle.loads(pickle.dumps(model))
    np.testing.assert_array_equal(again.spectra([setting()]), model.spectra([setting()]))


def test_what_there_is_not_is_named_and_a_bullet_that_stays_has_no_spectrum():
    with pytest.raises(LookupError, match="no modes of a plate of 'aluminum'; there are: steel"):
        twin(plate=PlateStage({"steel": ringing_plate()})).predict(setting())
    with pytest.raises(
        LookupError, match="no impact position '#9' on this plate; there are: #1, #2"
    ):
        twin().predict(setting(impact_position="#9"))
    with pytest.raises(LookupError, match="no sensor 'a9'; there are: a1, a2"):
        twin().spectra([setting()], "a9")
    with pytest.raises(ValueError, match="has no gun"):
        twin(gun=None).predict(setting(tank_pressure_pa=1e5))
    with pytest.raises(ValueError, match="plates with different sensors"):
        other = replace(ringing_plate(), sensors=("b1", "b2"))
        PlateStage({"aluminum": ringing_plate(), "steel": other})
    weak, good = setting(tank_pressure_pa=0.0), setting(tank_pressure_pa=4e5)
    spectra = twin().spectra([weak, good])
    assert np.all(spectra[0] == 0) and np.all(spectra[1] > 0)
    with pytest.raises(ValueError, match="does not leave the barrel at 0 bar"):
        twin().predict(weak)


def test_samples_beyond_those_that_are_asked_for_are_not_made():
    phases = np.sin(np.linspace(0, np.pi, 101))
    times = np.array([1e-3, 0.05, 2.0])
    pulses = ForcePulses(times, np.tile(phases, (3, 1)), times / 2)
    some, all_of_them = sampled(pulses, 1e-5, 2000), sampled(pulses, 1e-5)
    assert some.shape == (3, 2000)
    np.testing.assert_allclose(all_of_them.sum(axis=1) * 1e-5, pulses.impulse_n_s, rtol=1e-12)
    assert all_of_them.shape[1] > 100 * 2000 / 2
    np.testing.assert_allclose(some, all_of_them[:, :2000], rtol=1e-6)
    # those that end within keep their impulse, to rounding
    np.testing.assert_allclose(some[0].sum() * 1e-5, pulses.impulse_n_s[0], rtol=1e-12)
    pulses = ForcePulses(np.array([1e-3, 1e4]), np.ones((2, 11)), np.array([5e-4, 5e3]))
    assert sampled(pulses, 1e-6, 1000).shape == (2, 1000)


def test_peak_acceleration_is_of_the_plates_band_whatever_lines_are_asked_for():
    few, many = (
        twin(frequency_hz=np.geomspace(100, high, 9)).predict(setting(), draws=0)
        for high in (500.0, 10_000.0)
    )
    assert (
        few.acceleration_band_hz == many.acceleration_band_hz == ringing_plate().frequency_hz.max()
    )
    for sensor in few.sensors:
        assert few.peak_acceleration_m_s2(sensor) == many.peak_acceleration_m_s2(sensor)
        assert few.as_json()["acceleration"][sensor]["band_hz"] == [0.0, few.acceleration_band_hz]
