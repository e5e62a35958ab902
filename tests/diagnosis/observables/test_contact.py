"""The contact's stage against the twin's own impacts, Hertz in closed form, and the virtual bench's
other laws."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pyroshock.diagnosis.observables.base import sensor_chain
from pyroshock.diagnosis.observables.contact.features import NAMES, OBSERVABLES
from pyroshock.diagnosis.observables.contact.stage import ContactObservables, pulse_residuals
from pyroshock.diagnosis.record import CampaignRecord, Series
from pyroshock.twin.effects import Effect, catalogue, effect
from pyroshock.twin.setting import THESIS
from pyroshock.virtualbench.effects import Effects
from pyroshock.virtualbench.effects import EffectSwitch as Played
from pyroshock.virtualbench.impact.build import Impactor, ImpactTarget, contact_material, target
from pyroshock.virtualbench.impact.strike import STEP_S, strike_many
from support.records.contact_campaigns import FOUR, MASS_KG, hammer_record, without

TOLERANCE = np.array([one.tolerance for one in OBSERVABLES])
CLEAN = hammer_record()
STAGE = ContactObservables(CLEAN)
SHOWN = [catalogue()[each]() for each in STAGE.shows]
EACH = pytest.mark.parametrize("each", SHOWN, ids=lambda each: each.id)
MILD = effect("contact.plate_compliance", share=0.1)


def column(values: np.ndarray, name: str) -> np.ndarray:
    return values[..., NAMES.index(name)]


def in_tolerances(record: CampaignRecord, effects: list[Effect]) -> np.ndarray:
    """Mean residual of the whole campaign (d,)."""
    stage = ContactObservables(record)
    return np.asarray(((stage.measured() - stage.simulated(effects)) / TOLERANCE).mean(axis=0))


def test_elastic_campaign_has_no_gap() -> None:
    assert np.abs(in_tolerances(hammer_record(repetitions=8), [])).max() < 0.3
    assert residual({}, []).max() < 0.15


def without_plate_material(record: CampaignRecord) -> CampaignRecord:
    kept = [
        {k: v for k, v in each.factors.items() if k != "plate_material"}
        for each in record.configurations
    ]
    pairs = zip(record.configurations, kept, strict=True)
    return replace(
        record, configurations=tuple(replace(each, factors=factors) for each, factors in pairs)
    )


def test_plate_is_that_of_the_runs_or_of_the_bench() -> None:
    # A hammer's plan has no factor plate_material: `[bench.plate]` has it.
    stage = ContactObservables(replace(without_plate_material(CLEAN), plate_material="aluminum"))
    np.testing.assert_array_equal(stage.simulated(), STAGE.simulated())
    stage = ContactObservables(replace(CLEAN, plate_material="steel"))
    np.testing.assert_array_equal(stage.simulated(), STAGE.simulated())
    with pytest.raises(ValueError, match=r"no plate_material: .* column .* \[bench.plate\]"):
        ContactObservables(without_plate_material(CLEAN))


@EACH
def test_planted_effect_leaves_no_gap_once_it_is_added(each: Effect) -> None:
    assert np.abs(in_tolerances(hammer_record([each], repetitions=6), [each])).max() < 0.3


def test_mass_and_sensors_change_features_by_their_powers() -> None:
    change = STAGE.changes([[effect("contact.effective_mass", mass_factor=1.2)]])[0]
    for name, power in (
        ("ln_impulse", 1.0),
        ("ln_peak", 0.6),
        ("ln_width_half", 0.4),
        ("ln_width_tenth", 0.4),
    ):
        assert column(change, name) == pytest.approx(power * np.log(1.2), abs=2e-3)
    change = STAGE.changes([[effect("sensor.force_gain", gain=0.9)]])[0]
    assert column(change, "ln_peak") == pytest.approx(np.log(0.9), abs=1e-9)
    assert column(change, "ln_impulse") == pytest.approx(np.log(0.9), abs=1e-9)
    assert change[:, 2:] == pytest.approx(np.zeros_like(change[:, 2:]), abs=1e-9)
    change = STAGE.changes([[effect("sensor.velocity_gain", gain=1.1)]])[0]
    assert column(change, "ln_impulse") == pytest.approx(-np.log(1.1), abs=2e-3)
    assert column(change, "ln_peak") == pytest.approx(-1.2 * np.log(1.1), abs=2e-3)
    assert column(change, "ln_width_half") == pytest.approx(0.2 * np.log(1.1), abs=2e-3)
    change = STAGE.changes([[effect("sensor.force_bandwidth", time_constant_s=3e-5)]])[0]
    assert column(change, "ln_impulse") == pytest.approx(np.zeros(len(FOUR)), abs=8e-3)
    assert np.all(column(change, "ln_peak") < 0)
    assert np.all(column(change, "ln_width_tenth") > 0)
    change = STAGE.changes([[effect("contact.layer_compliance", compliance_m_n=1e-6)]])[0]
    acting = np.abs(change / TOLERANCE).max(axis=1) > 0.5
    assert acting.tolist() == [insulator != "none" for *_, insulator in FOUR]
    others = [kind() for each, kind in catalogue().items() if each not in STAGE.shows]
    assert np.all(STAGE.changes([[one] for one in others]) == 0)
    assert np.all(STAGE.changes([[]]) == 0)


def test_changes_are_differences_of_simulations() -> None:
    sets = [*([each] for each in SHOWN), [MILD, SHOWN[0]], [SHOWN[0], MILD], [SHOWN[-1], MILD]]
    together = STAGE.changes(sets)
    assert together == pytest.approx(
        np.concatenate([STAGE.changes([one]) for one in sets]), abs=1e-3
    )
    chosen, nominal = STAGE.representatives(), STAGE.simulated()
    for each in SHOWN:
        expected = (STAGE.simulated([each]) - nominal)[chosen]
        assert STAGE.changes([[each]])[0] == pytest.approx(expected, abs=1e-3)
    speeds = STAGE.recorded_m_s.reshape(len(FOUR), -1)
    assert STAGE.recorded_m_s[STAGE.representatives()] == pytest.approx(np.median(speeds, axis=1))


def test_effects_show_only_where_they_can() -> None:
    bare = ContactObservables(hammer_record(settings=FOUR[:2]))
    assert "contact.layer_compliance" not in bare.shows
    assert "contact.viscous_loss" in bare.shows
    soft = {name: replace(one, yield_strength_pa=None) for name, one in THESIS.items()}
    assert "contact.plastic_yield" not in ContactObservables(replace(CLEAN, materials=soft)).shows
    runs = tuple(replace(run, force=None) for run in CLEAN.runs)
    assert ContactObservables(replace(CLEAN, runs=runs)).shows == ()


def test_what_was_not_recorded_is_nan() -> None:
    lacking = ContactObservables(without(without(CLEAN, 0, velocity_m_s=None), 1, force=None))
    gone = np.isnan(lacking.residuals()).all(axis=1)
    assert np.flatnonzero(gone).tolist() == [0, 1]
    assert not np.isnan(lacking.residuals()[2:]).any()
    runs = tuple(
        replace(run, velocity_m_s=None) if run.configuration == 2 else run for run in CLEAN.runs
    )
    stage = ContactObservables(replace(CLEAN, runs=runs), {"impactor_mass_kg": 0.1})
    for values in (stage.changes([[MILD]])[0], stage.nuisances()["impactor_mass_kg"]):
        assert np.isnan(values).all(axis=1).tolist() == [False, False, True, False]
    assert ContactObservables(without(CLEAN, 3, velocity_m_s=None)).output()[3] is None


def test_output_is_the_true_force_and_carries_the_momentum() -> None:
    gain = effect("sensor.velocity_gain", gain=1.2)
    twice = [2.0 * run.velocity_m_s for run in CLEAN.runs if run.velocity_m_s is not None]
    assert STAGE.simulated([gain], twice) == pytest.approx(STAGE.simulated((), twice))
    late = effect("sensor.velocity_gain", gain=1.2, growth=1.0)
    true_m_s = sensor_chain([late]).true_velocity_m_s(STAGE.recorded_m_s)
    assert STAGE.simulated([late]) == pytest.approx(STAGE.simulated((), true_m_s.tolist()))
    faster = STAGE.simulated((), twice) - STAGE.simulated()
    assert column(faster, "ln_impulse") == pytest.approx(np.log(2.0), abs=3e-3)
    forces = STAGE.output()
    given = [
        float(each.values.sum()) / each.sampling_rate_hz
        for each in forces
        if isinstance(each, Series)
    ]
    assert given == pytest.approx(2 * MASS_KG * STAGE.recorded_m_s, rel=2e-3)
    true, seen = STAGE.output()[0], STAGE.output([effect("sensor.force_gain", gain=2.0)])[0]
    assert isinstance(true, Series) and isinstance(seen, Series)
    assert seen.values == pytest.approx(true.values)
    shots = tuple(replace(run, bullet_mass_kg=2 * MASS_KG) for run in CLEAN.runs)
    heavier = (
        ContactObservables(replace(CLEAN, kind="gun", runs=shots)).simulated() - STAGE.simulated()
    )
    assert column(heavier, "ln_impulse") == pytest.approx(np.log(2.0), abs=3e-3)


def test_uncertain_mass_is_a_nuisance() -> None:
    column_of_mass = ContactObservables(CLEAN, {"impactor_mass_kg": 0.05}).nuisances()[
        "impactor_mass_kg"
    ]
    assert column(column_of_mass, "ln_impulse") == pytest.approx(0.05, abs=5e-4)
    assert column(column_of_mass, "ln_peak") == pytest.approx(0.03, abs=5e-4)
    with pytest.raises(ValueError, match=r"no uncertain quantity 'colour'.*impactor_mass_kg"):
        ContactObservables(CLEAN, {"colour": 0.1})
    with pytest.raises(ValueError, match=r"run 1: no mass; give \[bench.hammer\] mass_kg"):
        ContactObservables(replace(CLEAN, hammer_mass_kg=None))
    with pytest.raises(ValueError, match=r"tip_material = 'aluminum'.*steel"):
        ContactObservables(replace(CLEAN, materials={"steel": THESIS["steel"]}))


@pytest.mark.slow
def test_example_has_more_impulse_than_its_mass(examples: Path) -> None:
    from pyroshock.diagnosis.reading.campaign import read_folder

    gap = (
        ContactObservables(read_folder(examples / "hammer-effective-mass")).residuals() / TOLERANCE
    ).mean(axis=0)
    assert column(gap, "ln_impulse") > 5
    assert column(gap, "ln_peak") / column(gap, "ln_impulse") == pytest.approx(0.6, abs=0.05)
    assert np.abs(gap[4:]).max() < 0.3


HEAVY = effect("contact.effective_mass", mass_factor=1.3)
RECORD = hammer_record([HEAVY], repetitions=1)


def test_missing_mass_shows_in_time_and_at_low_frequency() -> None:
    residuals = pulse_residuals(ContactObservables(RECORD))
    assert np.all(
        (residuals.measured - residuals.simulated).max(axis=1)
        > 0.1 * residuals.measured.max(axis=1)
    )
    ratio = (
        residuals.spectrum_n_s(residuals.measured)[:, 0]
        / residuals.spectrum_n_s(residuals.simulated)[:, 0]
    )
    assert ratio == pytest.approx(1.3, rel=5e-3)
    at = int(np.argmin(np.abs(residuals.time_s)))
    for force in (residuals.measured, residuals.simulated):
        assert force[:, at] / force.max(axis=1) == pytest.approx(0.5, abs=0.02)
    assert residuals.frequency_hz.size == residuals.spectrum_n_s(residuals.measured).shape[1]
    residuals = pulse_residuals(ContactObservables(RECORD), [HEAVY])
    peak = residuals.measured.max(axis=1, keepdims=True)
    assert np.abs((residuals.measured - residuals.simulated) / peak).max() < 0.02


def test_missing_run_is_nan() -> None:
    residuals = pulse_residuals(
        ContactObservables(without(without(RECORD, 0, velocity_m_s=None), 1, force=None))
    )
    assert np.isnan(residuals.simulated).all(axis=1).tolist() == [True, False, False, False]
    assert np.isnan(residuals.measured).all(axis=1).tolist() == [False, True, False, False]
    silent = replace(RECORD, runs=tuple(replace(run, force=None) for run in RECORD.runs))
    with pytest.raises(ValueError, match="no run has both a recorded force and a velocity"):
        pulse_residuals(ContactObservables(silent))


RATE_HZ = 102_400.0
BARE = (
    ("aluminum", 0.03, "none", "none"),
    ("delrin", 0.03, "none", "none"),
    ("steel", 0.015, "none", "none"),
)


def played(strengths: Mapping[str, float]) -> CampaignRecord:
    """The runs of an elastic campaign, struck again on the virtual bench: a rigid impactor and a
    face without mass."""
    record, rng = hammer_record(settings=BARE, repetitions=2), np.random.default_rng(0)
    tips = [contact_material(BARE[run.configuration][0]) for run in record.runs]
    strikers = [
        Impactor(tip, BARE[run.configuration][1], MASS_KG)
        for tip, run in zip(tips, record.runs, strict=True)
    ]
    acting = Effects(tuple(Played(name, strength=value) for name, value in strengths.items()))
    speeds = [run.velocity_m_s for run in record.runs if run.velocity_m_s is not None]
    targets: list[ImpactTarget] = [target("aluminum", 0.01)] * len(strikers)
    hits = strike_many(strikers, targets, acting, speeds, np.random.default_rng(1), tail_s=0.0)
    forces = [sampled(hit.force_n, rng) for hit in hits]
    runs = tuple(replace(run, force=force) for run, force in zip(record.runs, forces, strict=True))
    return replace(record, runs=runs)


def sampled(force_n: np.ndarray, rng: np.random.Generator) -> Series:
    last = force_n.size * STEP_S
    time = (np.arange(-20, int(1.3 * last * RATE_HZ) + 20) + rng.random()) / RATE_HZ
    return Series(
        np.interp(time, STEP_S * np.arange(force_n.size), force_n, left=0, right=0),
        RATE_HZ,
        float(time[0]),
    )


def residual(strengths: Mapping[str, float], effects: list[Effect]) -> np.ndarray:
    stage = ContactObservables(played(strengths))
    return np.asarray(np.abs((stage.measured() - stage.simulated(effects)) / TOLERANCE).max(axis=0))


@pytest.mark.parametrize(
    ("played_as", "strength", "same"),
    [
        ("contact.plate_compliance", 0.3, effect("contact.plate_compliance", share=0.3)),
        ("contact.effective_mass", 4.0, effect("contact.effective_mass", mass_factor=1.2)),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_effect_of_the_bench_is_the_twins(played_as: str, strength: float, same: Effect) -> None:
    before, after = residual({played_as: strength}, []), residual({played_as: strength}, [same])
    assert before.max() > 3
    assert after.max() < 0.5


@pytest.mark.parametrize("pressure", [1.5, 3.0, 5.0, 7.0, 9.0])
def test_yield_of_the_bench_is_not_the_twins(pressure: float) -> None:
    """Zhao, Maietta and Chang's loading beside Thornton's: no pressure brings all observables near
    their tolerance."""
    same = effect("contact.plastic_yield", pressure_over_yield_strength=pressure)
    assert residual({"contact.plastic_yield": 1.0}, [same]).max() > 5
