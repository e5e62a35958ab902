"""Readings of the tank's pressure against records of known shape, and what they tell apart that
velocities do not."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from pyroshock.array_types import Floats
from pyroshock.diagnosis.diagnose import diagnose
from pyroshock.diagnosis.observables.base import sensor_chain
from pyroshock.diagnosis.observables.gun.stage import GunObservables
from pyroshock.diagnosis.observables.gun.tank_pressure import (
    PressureWindows,
    measured_pressures,
    reading_noise_pa,
)
from pyroshock.diagnosis.options import Options
from pyroshock.diagnosis.record import CampaignRecord, Series
from pyroshock.twin.effects import Effect, effect
from pyroshock.twin.gun.shots import gun_velocity
from support.records.gun_campaigns import gun_record

RATE_HZ = 2000.0
TANK_OVER_BORE_M = 5.0
OUTLET_M2 = 8e-4


def trace_of(
    pressure_pa: float, rest_pa: float = 0.0, noise_pa: float = 0.0, seed: int = 0
) -> Series:
    """A level, a straight fall over 0.2 s that is halfway at the exit, and what is left."""
    time = np.arange(-0.4, 1.0, 1 / RATE_HZ)
    fall = np.clip((time + 0.1) / 0.2, 0.0, 1.0)
    values = pressure_pa + (rest_pa - pressure_pa) * fall
    return Series(
        values + noise_pa * np.random.default_rng(seed).standard_normal(time.size),
        RATE_HZ,
        float(time[0]),
    )


def read(traces: Sequence[Series | None], pressure_pa: Sequence[float]) -> Floats:
    before = np.array(pressure_pa)
    windows = PressureWindows.of(np.full(before.size, 0.1), before, 0.0, TANK_OVER_BORE_M)
    return measured_pressures(traces, before, np.arange(before.size), windows)


def test_readings_are_means_before_the_exit_and_half_a_transit_before_it() -> None:
    at_exit, on_the_way, empty, after = read([trace_of(2e5)], [2e5])[0]
    # The window is 5 ms long; the fall is 5 % of the level in 10 ms, and halfway at the exit.
    assert at_exit == pytest.approx(0.5 + 5 * 2.5e-3, abs=2e-3)
    assert on_the_way == pytest.approx(0.75, abs=2e-3)
    assert after == pytest.approx(0.5 - 5 * 0.7 * TANK_OVER_BORE_M / 343.0, abs=2e-3)
    assert empty == 0.0


def test_an_offset_is_what_an_empty_tank_shows_and_a_valve_that_shuts_is_none() -> None:
    pressure = [0.5e5, 1e5, 2e5, 4e5]
    offset = [trace_of(p + 600.0, 600.0, 50.0, seed) for seed, p in enumerate(pressure)]
    np.testing.assert_allclose(read(offset, pressure)[:, 2], 600.0 / 1e5, atol=20 / 1e5)
    shut = [trace_of(p, 0.06 * p, 50.0, seed) for seed, p in enumerate(pressure)]
    assert np.isnan(read(shut, pressure)[:, 2:]).all()
    assert np.isnan(read([trace_of(2e5, 0.4e5)], [2e5])[0, 2:]).all()


def test_a_valve_that_shuts_on_a_rest_which_differs_from_shot_to_shot_shows_no_offset() -> None:
    """Slow shots leave the valve less time, so that the rest need not go with the pressure; an
    offset is the same."""
    pressure = [0.5e5, 1e5, 2e5, 4e5] * 3
    rests = np.random.default_rng(3).permutation(np.linspace(300.0, 4500.0, 12))
    shut = [
        trace_of(p + rest, rest, 50.0, seed)
        for seed, (p, rest) in enumerate(zip(pressure, rests, strict=True))
    ]
    assert np.isnan(read(shut, pressure)[:, 2]).all()
    offset = [trace_of(p + 600.0, 600.0, 50.0, seed) for seed, p in enumerate(pressure[:-1])]
    one_shut = [*offset, trace_of(4e5, 2600.0, 50.0, 11)]
    empty = read(one_shut, pressure)[:, 2]
    np.testing.assert_allclose(empty[:-1], 600.0 / 1e5, atol=20 / 1e5)
    assert np.isnan(empty[-1])


def test_a_record_that_begins_too_late_or_ends_too_early_has_no_reading() -> None:
    trace = trace_of(2e5)
    late = Series(
        trace.values[-1990:], RATE_HZ, float(trace.time_s[-1990])
    )  # from 5 ms after the exit on
    assert np.isnan(read([late, None], [2e5, 2e5])[:, :2]).all()
    assert reading_noise_pa([None]) == 0.0
    assert reading_noise_pa([trace_of(2e5, 0.0, 400.0)]) == pytest.approx(400.0 / 2, rel=0.1)


def recorded(effects: Sequence[Effect], *, seed: int = 1) -> CampaignRecord:
    """The shots of `gun_record`, with the pressure that the twin's tank has on the way and as it
    empties."""
    record = gun_record(
        effects, seed=seed, pressures_pa=(0.4e5, 0.8e5, 1.6e5, 3.2e5), masses_kg=(0.15, 0.4, 1.0)
    )
    assert record.gun is not None
    rng = np.random.default_rng(seed)
    gun_effects = [each for each in effects if each.stage() == "gun"]
    runs = []
    for run in record.runs:
        leads = np.arange(0.3, 0.0, -1 / RATE_HZ)
        later_s = np.concatenate([[0.0], np.geomspace(1e-3, 1.2, 60)])
        shot = gun_velocity(
            record.gun,
            run.tank_pressure_pa,
            run.bullet_mass_kg,
            gun_effects,
            before_exit_s=np.concatenate([leads, -later_s])[None, :],
            outlet_area_m2=OUTLET_M2,
        )
        pressure_pa = shot.tank_pressure_pa[0]
        after = np.interp(np.arange(0, 1.2, 1 / RATE_HZ), later_s, pressure_pa[leads.size :])
        values = np.concatenate([pressure_pa[: leads.size], after])
        noisy = values + 500.0 * rng.standard_normal(values.size)
        runs.append(replace(run, tank_pressure=Series(noisy, RATE_HZ, -float(leads[0]))))
    return replace(record, runs=tuple(runs))


def test_the_stage_that_shot_a_record_finds_it_and_another_does_not() -> None:
    leak = effect("gun.blow_by", discharge_coefficient=0.5)
    stage = GunObservables(recorded([leak]))
    sizes = np.array([item.tolerance for item in stage.observables])
    names = [item.name for item in stage.observables]
    readings = [
        "pressure_at_exit",
        "pressure_on_the_way",
        "pressure_when_empty",
        "pressure_after_exit",
    ]
    assert names == ["ln_velocity", *readings]
    explained = (stage.measured() - stage.simulated([leak])) / sizes
    assert np.sqrt(np.nanmean(explained**2, axis=0)).max() < 1.0
    nominal = stage.residuals() / sizes
    assert np.sqrt(np.nanmean(nominal**2, axis=0))[1] > 4
    moved = stage.changes([[leak]])[0][stage.record.configuration_of]
    np.testing.assert_allclose(moved, stage.simulated([leak]) - stage.simulated(), atol=1e-9)
    assert {"pressure_lag_s", "laser_m", "outlet", "muzzle"} <= set(stage.nuisances())
    assert stage.possible_channels == ()


def test_a_leak_is_told_from_friction_by_its_record_and_by_velocities_is_not() -> None:
    """Without the record the set names the channel that would tell its members apart."""
    leak = effect("gun.blow_by", discharge_coefficient=0.15)
    record = recorded([leak])
    options = Options(plan=False, where=False, catalogue=("gun.blow_by", "gun.sliding_friction"))
    with_record = diagnose(record, options=options)
    assert with_record.first.effects == ("gun.blow_by",)
    assert with_record.sets[0].effects == ("gun.blow_by",)
    without = replace(record, runs=tuple(replace(run, tank_pressure=None) for run in record.runs))
    shares = {row.effect: row.inclusion for row in diagnose(without, options=options).effects}
    assert shares["gun.sliding_friction"] > 2 * next(
        row.inclusion for row in with_record.effects if row.effect == "gun.sliding_friction"
    )
    possible = GunObservables(without).possible_observables("tank_pressure", [[leak], []])
    white_difference = (possible.predicted[0] - possible.predicted[1]) / np.sqrt(
        np.diag(possible.noise)
    )
    assert np.sqrt(np.nansum(white_difference**2)) > 3  # told apart
    with pytest.raises(LookupError, match="cannot say what 'temperature' would show"):
        GunObservables(without).possible_observables("temperature", [])


def test_a_regulator_that_differs_from_the_transducer_shows_the_gain_of_the_latter() -> None:
    """The regulator tells the truth; the transducer reads 5 % more, and shots are slower than it
    makes believe."""
    record = gun_record([effect("sensor.pressure_gain", gain=1.05)])
    runs = tuple(
        replace(run, set_pressure_pa=(run.tank_pressure_pa or 0.0) / 1.05) for run in record.runs
    )
    stage = GunObservables(replace(record, runs=runs))
    assert [item.name for item in stage.observables] == ["ln_velocity", "ln_set_pressure"]
    np.testing.assert_allclose(stage.residuals()[:, 1], -np.log(1.05), atol=1e-12)
    gain = stage.simulated([effect("sensor.pressure_gain", gain=1.05)])
    np.testing.assert_allclose(stage.measured()[:, 1], gain[:, 1], atol=1e-12)
    np.testing.assert_allclose(stage.nuisances()["regulator"][:, 1], 0.01)
    names = ("sensor.pressure_gain", "gun.sliding_friction", "sensor.velocity_gain")
    options = Options(plan=False, where=False, catalogue=names)
    assert diagnose(replace(record, runs=runs), options=options).first.effects == (
        "sensor.pressure_gain",
    )


@pytest.mark.parametrize("offset_pa", [-600.0, 600.0])
def test_an_empty_tank_reads_the_offset_of_either_sign(offset_pa: float) -> None:
    stage, offset = (
        GunObservables(recorded([])),
        effect("sensor.pressure_offset", offset_pa=offset_pa),
    )
    moved = stage.simulated([offset]) - stage.simulated()
    np.testing.assert_allclose(moved[:, 3], offset_pa / 1e5, rtol=1e-9)


def test_a_gain_that_grows_shows_by_its_own_characteristic() -> None:
    stage, growing = (
        GunObservables(recorded([])),
        effect("sensor.pressure_gain", gain=1.05, growth=1.0),
    )
    before_pa = stage.record.run_values("tank_pressure_pa")
    scale_pa = np.hypot(
        before_pa, reading_noise_pa([run.tank_pressure for run in stage.record.runs]) / 0.01
    )
    true_pa = stage.simulated((), before_pa.tolist())[:, 1:3] * scale_pa[:, None]
    read_pa = stage.simulated([growing], before_pa.tolist())[:, 1:3] * scale_pa[:, None]
    # the true pressure of what is read: read / 1.05^(read / 2.5 bar)
    np.testing.assert_allclose(read_pa / 1.05 ** (read_pa / 2.5e5), true_pa, rtol=1e-9)
    assert np.nanmax(true_pa) > 1.5e5


def test_a_gain_that_grows_is_named_and_its_growth_is_found() -> None:
    """The regulator tells the truth; the transducer is right near nothing and reads 10 % more at
    2.5 bar, so that no plain gain and no offset fits what it reads at 0.3 to 2.4 bar."""
    growing = effect("sensor.pressure_gain", gain=1.1, growth=1.0)
    record = gun_record([growing])
    true_pa = sensor_chain([growing]).true_pressure_pa(record.run_values("tank_pressure_pa"))
    runs = tuple(
        replace(run, set_pressure_pa=float(pa))
        for run, pa in zip(record.runs, true_pa, strict=True)
    )
    names = (
        "sensor.pressure_gain",
        "sensor.pressure_offset",
        "gun.sliding_friction",
        "sensor.velocity_gain",
    )
    report = diagnose(
        replace(record, runs=runs), options=Options(plan=False, where=False, catalogue=names)
    )
    assert report.first.effects == ("sensor.pressure_gain",)
    fitted = {item.name: item.value for item in report.first.parameters}
    assert fitted["gain"] == pytest.approx(1.1, abs=0.02)
    assert fitted["growth"] == pytest.approx(1.0, abs=0.35)
