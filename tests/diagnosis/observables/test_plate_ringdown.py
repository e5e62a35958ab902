"""A plate whose force or whose places are not known: what its modes alone tell, against plates that were made."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pyroshock.diagnosis.chain import stages_of
from pyroshock.diagnosis.gap import GapMetric, GapTable
from pyroshock.diagnosis.observables.plate.ringdown import PlateRingdownStage
from pyroshock.diagnosis.options import Options
from pyroshock.diagnosis.record import CampaignRecord, Run
from pyroshock.twin.effects import effect
from support.records.plate_records import plate, played


def without_force(record: CampaignRecord) -> CampaignRecord:
    return replace(record, runs=tuple(replace(run, force=None) for run in record.runs))


def solved(record: CampaignRecord, **settings: str) -> CampaignRecord:
    """The same with a model of unknown places; the first configuration has `settings`."""
    first, *others = record.configurations
    first = replace(first, factors={**first.factors, **settings})
    return replace(record, plate_points_known=False, plate_model_material="steel", plate_material="steel",
                   configurations=(first, *others))  # fmt: skip


def silenced(run: Run, *channels: str) -> Run:
    """The run with NaN in these channels."""
    nothing = {
        name: replace(run.accelerations[name], values=run.accelerations[name].values * np.nan) for name in channels
    }
    return replace(run, accelerations={**run.accelerations, **nothing})


def residuals(stage: PlateRingdownStage) -> tuple[np.ndarray, np.ndarray]:
    """Medians over the runs: of ln frequency, of ln damping ratio."""
    frequency, damping = np.split(np.nanmedian(stage.residuals(), axis=0), 2)
    return frequency, damping


def test_nominal_and_solved_plates_agree_within_their_tolerances() -> None:
    frequency, damping = residuals(PlateRingdownStage(without_force(played(noise=1e-3))))
    assert frequency.size >= 8
    assert np.abs(frequency).max() < 5e-4
    assert np.abs(damping).max() < 0.03
    # A handbook's modulus and an assumed damping are known less well than a measured table.
    measured, model = (PlateRingdownStage(each) for each in (without_force(played()), solved(played())))
    assert {item.tolerance for item in measured.observables} == {0.002, 0.1}
    assert {item.tolerance for item in model.observables} == {0.01, 0.4}
    assert any("within 1% of a frequency and 40% of a damping ratio" in text for text in model.assumptions)
    stage = PlateRingdownStage(without_force(played()))
    assert stage.shows == ("plate.boundary", "plate.damping", "plate.sensor_mass", "plate.stiffness")
    assert "plate.sensor_mass" not in PlateRingdownStage(solved(played())).shows


@pytest.mark.parametrize("factor", [0.97, 1.04])
def test_a_stiffness_error_is_the_gap_of_every_frequency(factor: float) -> None:
    record = without_force(played([effect("plate.stiffness", frequency_factor=factor)], noise=1e-3))
    frequency, damping = residuals(PlateRingdownStage(record))
    np.testing.assert_allclose(frequency, np.log(factor), atol=1e-3)
    assert np.abs(damping).max() < 0.05


def test_simulated_effect_takes_the_gap_away() -> None:
    found = effect("plate.stiffness", frequency_factor=1.03)
    stage = PlateRingdownStage(without_force(played([found], noise=1e-3)))
    left = stage.residuals() - stage.changes([[found]])[0][stage.record.configuration_of]
    assert np.abs(np.nanmedian(left, axis=0)).max() < 0.03
    record = without_force(played([effect("plate.damping", factor=1.6)], noise=1e-3))
    frequency, damping = residuals(PlateRingdownStage(record))
    np.testing.assert_allclose(damping, np.log(1.6), atol=0.05)
    assert np.abs(frequency).max() < 5e-4


def test_where_a_sensor_stands_does_not_matter() -> None:
    """A model with shapes of its own, as of a drawing without places, reads the same as the table that was measured."""
    record, rng = played(noise=1e-3), np.random.default_rng(0)
    table = plate()
    elsewhere = replace(table, shapes=rng.normal(size=table.shapes.shape), shape_impact=-table.shape_impact)
    one, other = (PlateRingdownStage(replace(solved(record), plate=model)) for model in (table, elsewhere))
    np.testing.assert_array_equal(one.residuals(), other.residuals())


@pytest.mark.parametrize(("column", "level"), [("plate_material", "aluminum"), ("boundary_conditions", "fixed")])
def test_runs_on_another_plate_have_no_part(column: str, level: str) -> None:
    stage = PlateRingdownStage(solved(played(), **{column: level}))
    other = stage.record.configuration_of == 0
    assert np.isnan(stage.residuals()[other]).all()
    assert np.isfinite(stage.residuals()[~other]).any()
    assert any(f"{other.sum()} runs on a plate of another material" in text for text in stage.assumptions)


def test_a_channel_of_nan_leaves_the_other() -> None:
    record = without_force(played(noise=1e-3))
    runs = tuple(silenced(run, "acceleration_2") for run in record.runs)
    frequency, _ = residuals(PlateRingdownStage(replace(record, runs=runs)))
    assert frequency.size >= 6
    assert np.abs(frequency).max() < 5e-4
    record = without_force(played())
    runs = tuple(silenced(run, *run.accelerations) for run in record.runs)
    with pytest.raises(ValueError, match="no run has an acceleration of the plate that goes on after the contact"):
        PlateRingdownStage(replace(record, runs=runs))
    (stage,), notes = stages_of(without_force(played()), Options())
    assert isinstance(stage, PlateRingdownStage)
    assert any("no force was recorded beside the accelerations" in note for note in notes)


def test_its_gap_is_in_tolerances_of_modes() -> None:
    stage = PlateRingdownStage(without_force(played([effect("plate.stiffness", frequency_factor=1.02)], noise=1e-3)))
    gap = GapTable.of(stage.record, [stage])
    size = GapMetric.of(gap).size(gap)
    assert "modal frequencies and damping ratios" in size.metric
    assert size.before == pytest.approx(np.log(1.02) / 0.002 / np.sqrt(2), rel=0.1)
