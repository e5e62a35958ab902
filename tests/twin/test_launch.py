"""The gun stage with effects that nobody has stated: limits of energy and gas, what is beyond the
shots, bullets that stay in the barrel."""

from __future__ import annotations

import math
import pickle
import time
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pyroshock.twin.chain import Twin
from pyroshock.twin.contact_interface import Extrapolation
from pyroshock.twin.effects import effect
from pyroshock.twin.gun.bench import GunBench
from pyroshock.twin.gun.nominal import barrel_work_j, beyond_energy, escape_speed_m_s
from pyroshock.twin.gun.stage import GunStage
from pyroshock.twin.sensors.chain import SensorChain
from support.records.twin_parts import HalfSine, setting

IDEAL = GunBench(0.0095, 0.049, 0.048, 0.885, 0.3, 1.4, 1.0)
HALVED = replace(IDEAL, efficiency=0.5)
NOMINAL = SensorChain()
#: A sensor whose errors are stated, so that the tank's pressure is known.
EXACT = SensorChain.of(
    [
        effect("sensor.pressure_offset", offset_pa=0.0),
        effect("sensor.pressure_gain", gain=1.0),
        effect("sensor.velocity_gain", gain=1.0),
    ]
)


def gun(bench: GunBench = IDEAL, **own) -> GunStage:
    return GunStage(bench, **{"velocity_spread": 0.0, "unknown_effects": True} | own)


def every_gun(
    stage: GunStage, pressure: float, mass: float, chain: SensorChain = EXACT
) -> np.ndarray:
    """Velocities of all ranks."""
    from scipy.special import ndtri

    luck = np.random.default_rng(0).standard_normal(256)
    z = np.stack([ndtri((np.arange(256) + 0.5) / 256), luck], axis=1)
    return stage.velocity_draws(
        [setting(tank_pressure_pa=pressure, impactor_mass_kg=mass)], chain, z
    )[:, 0]


def test_more_than_the_escape_speed_is_refused_with_the_limit():
    assert escape_speed_m_s(1.4, 293.15) == pytest.approx(5 * 343.2, rel=1e-3)
    assert escape_speed_m_s(1.0, 293.15) == math.inf
    light = [setting(tank_pressure_pa=1e8, impactor_mass_kg=1e-3)]
    for stage in (gun(HALVED), GunStage(HALVED, 0.05)):
        with pytest.raises(
            ValueError,
            match=r"1000 bar with bullet_mass = 0\.001 kg.*1,716 m/s.*lower the pressure",
        ):
            stage.velocities(light, NOMINAL)
    most = math.sqrt(2 * float(barrel_work_j(IDEAL, 1e5, 0.0)) / 0.5)
    beyond = beyond_energy(IDEAL, np.full(2, 1e5), np.full(2, 0.5), np.array([0.99, 1.01]) * most)
    assert beyond.tolist() == [False, True]


@pytest.mark.parametrize("ahead", [0.0, 101_325.0])
@pytest.mark.parametrize("pressure", [0.1e5, 0.3e5, 5e5])
def test_barrel_work_is_the_integral_of_the_isothermal_force(pressure, ahead):
    """While it pushes: what comes after the gas is as thin as the air ahead takes work away."""
    volume = np.linspace(0, IDEAL.projectile_area_m2 * IDEAL.travel_m, 200_001)
    force = (pressure + ahead) / (1 + volume / IDEAL.tank_volume_m3) - ahead
    work = float(np.trapezoid(np.maximum(force, 0.0), volume))
    assert barrel_work_j(IDEAL, pressure, ahead) == pytest.approx(work, rel=1e-8)


def test_a_long_barrel_gives_the_exergy_of_the_tank():
    """p0 V0 ln(p0 / pa) - (p0 - pa) V0: Moran and Shapiro, ch. 7, for a gas at the surroundings'
    temperature."""
    pressure, air = 3e5, 101_325.0
    exergy = 0.0095 * ((pressure + air) * math.log((pressure + air) / air) - pressure)
    assert barrel_work_j(replace(IDEAL, travel_m=100.0), pressure, air) == pytest.approx(
        exergy, rel=1e-9
    )


@settings(max_examples=30, deadline=None)
@given(st.floats(3.5, 7.0), st.floats(-2.0, 1.0), st.sampled_from([IDEAL, HALVED]), st.booleans())
def test_no_draw_has_more_energy_than_its_gas_gives(log_pressure, log_mass, bench, learned):
    pressure, mass = 10**log_pressure, 10**log_mass
    stage = gun(bench, velocity_spread=0.05)
    if learned:
        stage = stage.updated(
            [1e5, 3e5], [0.5, 0.5], [17.0, 36.0]
        )  # close to what no losses at all would give
    velocity = every_gun(stage, pressure, mass)
    assert np.all(mass * velocity**2 / 2 <= barrel_work_j(bench, pressure, 0.0) * (1 + 1e-9))
    assert np.all(velocity <= escape_speed_m_s(1.4, 293.15))


def test_median_of_the_draws_is_the_central_velocity_by_the_stated_efficiency():
    for pressure, mass in (
        (0.4e5, 0.5),
        (1e5, 0.2),
        (4e5, 1.0),
    ):  # at the first a third of the bullets stay
        asked = [setting(tank_pressure_pa=pressure, impactor_mass_kg=mass)]
        drawn = every_gun(gun(), pressure, mass)
        central = gun().velocities(asked, EXACT)[0]
        assert np.median(drawn[drawn > 0]) == pytest.approx(central, rel=1e-3)
    ideal, halved = (np.median(every_gun(gun(bench), 2e5, 0.5)) for bench in (IDEAL, HALVED))
    stated = GunStage(HALVED, 0.0).fired(np.array([2e5]), np.array([0.5]))[0]
    assert halved == pytest.approx(stated, rel=0.15)
    assert ideal > 1.3 * halved


def test_a_draw_is_one_gun_for_all_settings_and_a_given_velocity_is_not_drawn():
    z = np.random.default_rng(0).standard_normal((32, 2))
    shot_settings = [
        setting(tank_pressure_pa=3e5),
        setting(tank_pressure_pa=3.1e5),
        setting(impact_velocity_m_s=7.0),
    ]
    first, second, given_velocity = gun().velocity_draws(shot_settings, NOMINAL, z).T
    assert (second / first).std() < 0.02 < first.std() / first.mean()
    assert given_velocity.tolist() == [7.0] * 32
    assert len(set(first[:4])) == 4


def test_bullets_that_stay_are_counted_and_left_out_of_the_bands():
    """At a low pressure some of the guns do not fire the bullet: the others make the bands."""
    low = setting(tank_pressure_pa=0.5e5)
    stage = gun(velocity_spread=0.05)
    probability = stage.leaving([low], NOMINAL)[0]
    assert 0.5 < probability < 0.98
    shot = Twin(HalfSine(), stage).predict(low, draws=64)
    stay = int(shot.models["gun"].rsplit("; ", 1)[1].split()[0])
    assert stay == pytest.approx(64 * (1 - probability), abs=1.5)
    assert shot.velocity_m_s.ci90[0] > 0
    with pytest.raises(
        ValueError,
        match=r"does not leave the barrel at 0\.001 bar \(it leaves with a probability of",
    ):
        Twin(HalfSine(), stage).predict(setting(tank_pressure_pa=100.0))


def test_measured_shots_make_no_bullet_leave_that_stays():
    """Far below its measured shots no gun fires 5 kg that fired less at more pressure: an empty
    tank fires nothing."""
    learned = gun().updated(
        np.array([0.232, 0.265, 0.3, 0.4, 0.5]) * 1e5, [0.1428] * 5, [10.4, 11.9, 13.0, 16.0, 18.5]
    )
    at = [
        setting(tank_pressure_pa=p, impactor_mass_kg=5.0)
        for p in (1.0, 20.0, 500.0, 2e3, 5e3, 5e4, 4e5)
    ]
    probability = learned.leaving(at, NOMINAL)
    assert np.all(np.diff(probability) >= 0) and probability[0] < 0.05 and probability[-1] > 0.95
    assert learned.velocities(at[:1], NOMINAL)[0] == 0


def test_warm_draws_take_milliseconds():
    z, asked = np.random.default_rng(0).standard_normal((64, 2)), [setting(tank_pressure_pa=2e5)]
    learned = gun().updated(
        np.linspace(1e5, 6e5, 30), np.tile([0.2, 0.5, 1.0], 10), np.linspace(12.0, 25.0, 30)
    )
    for stage in (gun(), learned):
        stage.velocity_draws(asked, NOMINAL, z)
        seconds = []
        for _ in range(20):
            begin = time.perf_counter()
            stage.velocity_draws(asked, NOMINAL, z)
            seconds.append(time.perf_counter() - begin)
        assert min(seconds) < 0.015


def test_pressure_and_mass_beyond_the_shots_are_named_with_their_ranges():
    learned = gun().updated([1e5, 6.7e5], [0.2, 1.0], [20.0, 30.0])
    asked = [
        setting(tank_pressure_pa=50e5, impactor_mass_kg=0.5),
        setting(tank_pressure_pa=3e5, impactor_mass_kg=1.5),
        setting(tank_pressure_pa=6.7e5, impactor_mass_kg=0.2),
        setting(impact_velocity_m_s=5.0),
    ]
    assert learned.extrapolation(asked) == [
        (Extrapolation("tank_pressure_pa", 50e5, 1e5, 6.7e5),),
        (Extrapolation("bullet_mass_kg", 1.5, 0.2, 1.0),),
        (),
        (),
    ]
    assert gun().extrapolation(asked) == [(), (), (), ()]


def test_sentence_says_what_the_velocity_rests_on_and_the_stage_goes_between_processes():
    assert gun().sentence.startswith("The velocity rests on no measured shot")
    learned = gun().updated([1e5, 6.7e5], [0.2, 0.2], [20.0, 40.0])
    assert learned.sentence == "The velocity rests on 2 measured shots, 1 to 6.7 bar and 0.2 kg."
    assert "a spread of 5.0%" in GunStage(IDEAL, 0.05).sentence
    with pytest.raises(ValueError, match=r"gun\.blow_by has a parameter with several values"):
        gun(effects=(effect("gun.blow_by", wear_m=np.array([1e-4, 2e-4])),))
    with pytest.raises(ValueError, match="expected unknown_effects"):
        GunStage(IDEAL, 0.05, shots=learned.shots)
    learned = gun().updated([1e5], [0.5], [12.0])
    again, shot_settings = pickle.loads(pickle.dumps(learned)), [setting(tank_pressure_pa=2e5)]
    np.testing.assert_array_equal(
        again.velocities(shot_settings, NOMINAL), learned.velocities(shot_settings, NOMINAL)
    )
