"""The contact's stage against the twin's own impacts, sampled anyhow, and against what Hertz says in closed form."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pyroshock.diagnosis.observables.contact.features import NAMES, OBSERVABLES
from pyroshock.diagnosis.observables.contact.stage import ContactObservables
from pyroshock.diagnosis.record import CampaignRecord, Series
from pyroshock.twin.effects import Effect, catalogue, effect
from pyroshock.twin.setting import THESIS
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


def without_plate_material(record: CampaignRecord) -> CampaignRecord:
    kept = [{k: v for k, v in each.factors.items() if k != "plate_material"} for each in record.configurations]
    pairs = zip(record.configurations, kept, strict=True)
    return replace(record, configurations=tuple(replace(each, factors=factors) for each, factors in pairs))


def test_the_bench_s_plate_is_struck_where_the_runs_name_none() -> None:
    """A hammer's plan has no factor plate_material: `[bench.plate]` has it."""
    stage = ContactObservables(replace(without_plate_material(CLEAN), plate_material="aluminum"))
    np.testing.assert_array_equal(stage.simulated(), STAGE.simulated())


def test_the_runs_plate_goes_before_the_bench_s() -> None:
    stage = ContactObservables(replace(CLEAN, plate_material="steel"))
    np.testing.assert_array_equal(stage.simulated(), STAGE.simulated())


def test_a_plate_that_nobody_names_is_refused_with_both_places() -> None:
    with pytest.raises(ValueError, match=r"no plate_material: .* column .* \[bench.plate\]"):
        ContactObservables(without_plate_material(CLEAN))


@EACH
def test_planted_effect_leaves_no_gap_once_it_is_added(each: Effect) -> None:
    assert np.abs(in_tolerances(hammer_record([each], repetitions=6), [each])).max() < 0.3


def test_more_mass_is_more_impulse() -> None:
    change = STAGE.changes([[effect("contact.effective_mass", mass_factor=1.2)]])[0]
    for name, power in (("ln_impulse", 1.0), ("ln_peak", 0.6), ("ln_width_half", 0.4), ("ln_width_tenth", 0.4)):
        assert column(change, name) == pytest.approx(power * np.log(1.2), abs=2e-3)


def test_gain_of_the_cell_is_one_of_peak_and_impulse() -> None:
    change = STAGE.changes([[effect("sensor.force_gain", gain=0.9)]])[0]
    assert column(change, "ln_peak") == pytest.approx(np.log(0.9), abs=1e-9)
    assert column(change, "ln_impulse") == pytest.approx(np.log(0.9), abs=1e-9)
    assert change[:, 2:] == pytest.approx(np.zeros_like(change[:, 2:]), abs=1e-9)


def test_reading_too_high_is_an_impact_slower_than_read() -> None:
    change = STAGE.changes([[effect("sensor.velocity_gain", gain=1.1)]])[0]
    assert column(change, "ln_impulse") == pytest.approx(-np.log(1.1), abs=2e-3)
    assert column(change, "ln_peak") == pytest.approx(-1.2 * np.log(1.1), abs=2e-3)
    assert column(change, "ln_width_half") == pytest.approx(0.2 * np.log(1.1), abs=2e-3)


def test_low_pass_keeps_the_impulse_and_lowers_the_peak() -> None:
    change = STAGE.changes([[effect("sensor.force_bandwidth", time_constant_s=3e-5)]])[0]
    assert column(change, "ln_impulse") == pytest.approx(np.zeros(len(FOUR)), abs=8e-3)
    assert np.all(column(change, "ln_peak") < 0)
    assert np.all(column(change, "ln_width_tenth") > 0)


def test_layer_acts_where_there_is_one() -> None:
    change = STAGE.changes([[effect("contact.layer_compliance", compliance_m_n=1e-6)]])[0]
    acting = np.abs(change / TOLERANCE).max(axis=1) > 0.5
    assert acting.tolist() == [insulator != "none" for *_, insulator in FOUR]


def test_effects_of_other_stages_do_nothing() -> None:
    others = [kind() for each, kind in catalogue().items() if each not in STAGE.shows]
    assert np.all(STAGE.changes([[one] for one in others]) == 0)
    assert np.all(STAGE.changes([[]]) == 0)


def test_sets_at_once_are_sets_one_by_one() -> None:
    sets = [*([each] for each in SHOWN), [MILD, SHOWN[0]], [SHOWN[0], MILD], [SHOWN[-1], MILD]]
    together = STAGE.changes(sets)
    assert together == pytest.approx(np.concatenate([STAGE.changes([one]) for one in sets]), abs=1e-3)


def test_changes_are_differences_of_simulations() -> None:
    chosen, nominal = STAGE.representatives(), STAGE.simulated()
    for each in SHOWN:
        expected = (STAGE.simulated([each]) - nominal)[chosen]
        assert STAGE.changes([[each]])[0] == pytest.approx(expected, abs=1e-3)


def test_representative_has_the_median_velocity() -> None:
    speeds = STAGE.recorded_m_s.reshape(len(FOUR), -1)
    assert STAGE.recorded_m_s[STAGE.representatives()] == pytest.approx(np.median(speeds, axis=1))


def test_layer_is_not_shown_without_one() -> None:
    bare = ContactObservables(hammer_record(settings=FOUR[:2]))
    assert "contact.layer_compliance" not in bare.shows
    assert "contact.viscous_loss" in bare.shows


def test_yield_is_not_shown_without_strengths() -> None:
    soft = {name: replace(one, yield_strength_pa=None) for name, one in THESIS.items()}
    assert "contact.plastic_yield" not in ContactObservables(replace(CLEAN, materials=soft)).shows


def test_nothing_is_shown_without_forces() -> None:
    runs = tuple(replace(run, force=None) for run in CLEAN.runs)
    assert ContactObservables(replace(CLEAN, runs=runs)).shows == ()


def test_run_without_velocity_or_force_is_nan() -> None:
    lacking = ContactObservables(without(without(CLEAN, 0, velocity_m_s=None), 1, force=None))
    gone = np.isnan(lacking.residuals()).all(axis=1)
    assert np.flatnonzero(gone).tolist() == [0, 1]
    assert not np.isnan(lacking.residuals()[2:]).any()


def test_configuration_without_velocities_is_nan() -> None:
    runs = tuple(replace(run, velocity_m_s=None) if run.configuration == 2 else run for run in CLEAN.runs)
    stage = ContactObservables(replace(CLEAN, runs=runs), {"impactor_mass_kg": 0.1})
    for values in (stage.changes([[MILD]])[0], stage.nuisances()["impactor_mass_kg"]):
        assert np.isnan(values).all(axis=1).tolist() == [False, False, True, False]


def test_upstream_velocity_is_true() -> None:
    gain = effect("sensor.velocity_gain", gain=1.2)
    twice = [2.0 * run.velocity_m_s for run in CLEAN.runs if run.velocity_m_s is not None]
    assert STAGE.simulated([gain], twice) == pytest.approx(STAGE.simulated((), twice))
    faster = STAGE.simulated((), twice) - STAGE.simulated()
    assert column(faster, "ln_impulse") == pytest.approx(np.log(2.0), abs=3e-3)


def test_output_carries_the_momentum() -> None:
    forces = STAGE.output()
    given = [float(each.values.sum()) / each.sampling_rate_hz for each in forces if isinstance(each, Series)]
    assert given == pytest.approx(2 * MASS_KG * STAGE.recorded_m_s, rel=2e-3)


def test_output_is_the_true_force() -> None:
    true, seen = STAGE.output()[0], STAGE.output([effect("sensor.force_gain", gain=2.0)])[0]
    assert isinstance(true, Series) and isinstance(seen, Series)
    assert seen.values == pytest.approx(true.values)


def test_output_is_none_without_velocity() -> None:
    assert ContactObservables(without(CLEAN, 3, velocity_m_s=None)).output()[3] is None


def test_bullet_strikes_with_its_own_mass() -> None:
    shots = tuple(replace(run, bullet_mass_kg=2 * MASS_KG) for run in CLEAN.runs)
    heavier = ContactObservables(replace(CLEAN, kind="gun", runs=shots)).simulated() - STAGE.simulated()
    assert column(heavier, "ln_impulse") == pytest.approx(np.log(2.0), abs=3e-3)


def test_uncertain_mass_is_a_nuisance() -> None:
    column_of_mass = ContactObservables(CLEAN, {"impactor_mass_kg": 0.05}).nuisances()["impactor_mass_kg"]
    assert column(column_of_mass, "ln_impulse") == pytest.approx(0.05, abs=5e-4)
    assert column(column_of_mass, "ln_peak") == pytest.approx(0.03, abs=5e-4)


def test_unknown_uncertain_quantity_is_refused() -> None:
    with pytest.raises(ValueError, match=r"no uncertain quantity 'colour'.*impactor_mass_kg"):
        ContactObservables(CLEAN, {"colour": 0.1})


def test_missing_mass_is_named() -> None:
    with pytest.raises(ValueError, match=r"run 1: no mass; give \[bench.hammer\] mass_kg"):
        ContactObservables(replace(CLEAN, hammer_mass_kg=None))


def test_unknown_material_is_named() -> None:
    with pytest.raises(ValueError, match=r"tip_material = 'aluminum'.*steel"):
        ContactObservables(replace(CLEAN, materials={"steel": THESIS["steel"]}))


@pytest.mark.slow
def test_example_has_more_impulse_than_its_mass(examples: Path) -> None:
    from pyroshock.diagnosis.reading.campaign import read_folder

    gap = (ContactObservables(read_folder(examples / "hammer-effective-mass")).residuals() / TOLERANCE).mean(axis=0)
    assert column(gap, "ln_impulse") > 5
    assert column(gap, "ln_peak") / column(gap, "ln_impulse") == pytest.approx(0.6, abs=0.05)
    assert np.abs(gap[4:]).max() < 0.3
