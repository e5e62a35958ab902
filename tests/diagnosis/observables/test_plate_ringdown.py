"""A plate whose force or places are not known: what its modes alone tell, and how they are
named."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pyroshock.diagnosis.chain import stages_of
from pyroshock.diagnosis.gap import GapMetric, GapTable
from pyroshock.diagnosis.observables.plate.modes import ModeLines, candidate_plates, matched
from pyroshock.diagnosis.observables.plate.ringdown import PlateRingdownStage
from pyroshock.diagnosis.observables.plate.spectra import RingingWindow
from pyroshock.diagnosis.observables.plate.stage import PlateObservables
from pyroshock.diagnosis.options import Options
from pyroshock.diagnosis.record import CampaignRecord, Run
from pyroshock.twin.effects import effect
from pyroshock.twin.plate.modal import ModalPlate, PlateEffect
from support.records.plate_records import RATE_HZ, plate, played


def without_force(record: CampaignRecord) -> CampaignRecord:
    return replace(record, runs=tuple(replace(run, force=None) for run in record.runs))


def solved(record: CampaignRecord, **settings: str) -> CampaignRecord:
    """The same with a model of unknown places; the first configuration has `settings`."""
    first, *others = record.configurations
    first = replace(first, factors={**first.factors, **settings})
    return replace(record, plate_points_known=False, plate_model_material="steel",
    plate_material="steel",
                   configurations=(first, *others))  # fmt: skip


def silenced(run: Run, *channels: str) -> Run:
    """The run with NaN in these channels."""
    nothing = {
        name: replace(run.accelerations[name], values=run.accelerations[name].values * np.nan)
        for name in channels
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
    measured, model = (
        PlateRingdownStage(record) for record in (without_force(played()), solved(played()))
    )
    assert {item.tolerance for item in measured.observables} == {0.002, 0.1}
    assert {item.tolerance for item in model.observables} == {0.01, 0.4}
    assert any(
        "within 1% of a frequency and 40% of a damping ratio" in text for text in model.assumptions
    )
    stage = PlateRingdownStage(without_force(played()))
    assert stage.shows == (
        "plate.boundary",
        "plate.damping",
        "plate.sensor_mass",
        "plate.stiffness",
    )
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
    # A model with shapes of its own, as of a drawing without places, reads the same as the table
    # that was measured.
    record, rng = played(noise=1e-3), np.random.default_rng(0)
    table = plate()
    elsewhere = replace(
        table, shapes=rng.normal(size=table.shapes.shape), shape_impact=-table.shape_impact
    )
    one, other = (
        PlateRingdownStage(replace(solved(record), plate=model)) for model in (table, elsewhere)
    )
    np.testing.assert_array_equal(one.residuals(), other.residuals())
    stage = PlateRingdownStage(
        without_force(played([effect("plate.stiffness", frequency_factor=1.02)], noise=1e-3))
    )
    gap = GapTable.of(stage.record, [stage])
    size = GapMetric.of(gap).size(gap)
    assert "modal frequencies and damping ratios" in size.metric
    assert size.before == pytest.approx(np.log(1.02) / 0.002 / np.sqrt(2), rel=0.1)


@pytest.mark.parametrize(
    ("column", "level"), [("plate_material", "aluminum"), ("boundary_conditions", "fixed")]
)
def test_runs_on_another_plate_have_no_part(column: str, level: str) -> None:
    stage = PlateRingdownStage(solved(played(), **{column: level}))
    other = stage.record.configuration_of == 0
    assert np.isnan(stage.residuals()[other]).all()
    assert np.isfinite(stage.residuals()[~other]).any()
    assert any(
        f"{other.sum()} runs on a plate of another material" in text for text in stage.assumptions
    )


def test_a_channel_of_nan_leaves_the_other() -> None:
    record = without_force(played(noise=1e-3))
    runs = tuple(silenced(run, "acceleration_2") for run in record.runs)
    frequency, _ = residuals(PlateRingdownStage(replace(record, runs=runs)))
    assert frequency.size >= 6
    assert np.abs(frequency).max() < 5e-4
    record = without_force(played())
    runs = tuple(silenced(run, *run.accelerations) for run in record.runs)
    with pytest.raises(
        ValueError, match="no run has an acceleration of the plate that goes on after the contact"
    ):
        PlateRingdownStage(replace(record, runs=runs))
    (stage,), notes = stages_of(without_force(played()), Options())
    assert isinstance(stage, PlateRingdownStage)
    assert any("no force was recorded beside the accelerations" in note for note in notes)


def lines(table: ModalPlate) -> ModeLines:
    return ModeLines(
        table.frequency_hz,
        np.abs(table.shapes * table.shape_impact).T * table.frequency_hz[:, None],
    )


def of_changed(name: str, **parameters: float) -> np.ndarray:
    change = effect(name, **parameters)
    assert isinstance(change, PlateEffect)
    return matched(
        lines(change.apply(plate())), [lines(candidate) for candidate in candidate_plates(plate())]
    )


def test_moved_plates_keep_the_names_of_their_modes() -> None:
    assert np.array_equal(matched(lines(plate()), [lines(plate())]), np.arange(10))
    table = plate()
    close = ModalPlate(
        table.frequency_hz[0] * 1.06 ** np.arange(10),
        table.damping_ratio,
        table.shape_impact,
        table.shapes,
        table.impact_points,
        table.sensors,
    )
    moved = effect("plate.stiffness", frequency_factor=1.07)
    assert isinstance(moved, PlateEffect)
    matches = matched(
        lines(moved.apply(close)), [lines(candidate) for candidate in candidate_plates(close)]
    )
    assert np.array_equal(matches, np.arange(10))
    for modes in (
        of_changed("plate.stiffness", frequency_factor=0.91),
        of_changed("plate.sensor_mass", mass_kg=0.28),
        of_changed("plate.boundary", support_frequency_hz=145.0),
    ):
        assert np.array_equal(modes, np.arange(10))


def test_foreign_and_missing_lines_have_no_mode() -> None:
    own = lines(plate())
    frequency = np.sort(np.append(own.frequency_hz, 2000.0))
    at = int(np.searchsorted(frequency, 2000.0))
    level = np.insert(own.level, at, 0.3 * own.level.mean(axis=0), axis=0)
    assert np.array_equal(matched(ModeLines(frequency, level), [own]), np.delete(np.arange(11), at))
    measured_lines = ModeLines(np.delete(own.frequency_hz, 3), np.delete(own.level, 3, axis=0))
    named = matched(measured_lines, [own])
    assert named[3] == -1
    assert np.array_equal(np.delete(named, 3), np.arange(9))


def dense() -> ModalPlate:
    """Sixty modes about 90 Hz apart, three rigid ones among them, as a finite element model has
    them."""
    rng = np.random.default_rng(8)
    frequency = np.concatenate(
        [np.zeros(3), 90.0 * (np.arange(57) + 1 + rng.uniform(-0.2, 0.2, 57))]
    )
    shape = rng.uniform(0.25, 0.7, (3, 60)) * rng.choice([-1.0, 1.0], (3, 60))
    ratio = np.where(frequency > 0, 0.003, 0.0)
    return ModalPlate(
        frequency, ratio, shape[:1], shape[1:], ("#1",), ("acceleration_1", "acceleration_2")
    )


def test_low_modes_of_a_dense_plate_are_read() -> None:
    planted = effect("plate.stiffness", frequency_factor=1.01)
    stage = PlateObservables(played([planted], noise=0.002, bench=dense()))
    frequency = [
        i for i, observable in enumerate(stage.observables) if "ln frequency" in observable.name
    ]
    assert len(frequency) > 5
    assert stage.residuals()[:, frequency] == pytest.approx(np.log(1.01), abs=5e-4)
    remaining = stage.measured() - stage.simulated([planted])
    assert (
        np.nanmax(np.abs(remaining / [observable.tolerance for observable in stage.observables]))
        < 1.5
    )


def test_window_takes_fewer_samples_and_keeps_the_mode() -> None:
    window = RingingWindow.of(200, 5000, RATE_HZ, 1000.0)
    time = np.arange(5000) / RATE_HZ
    low, high = np.exp(-20 * time) * np.cos(2 * np.pi * 900 * time), np.cos(2 * np.pi * 4000 * time)
    kept = window.start_s + window.step_s * np.arange(window.samples)
    expected = np.exp(-20 * kept) * np.cos(2 * np.pi * 900 * kept)
    assert window.kept.step == 12
    assert window.cut(low + high) == pytest.approx(expected, abs=2e-3)
