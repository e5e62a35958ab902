"""Naming the modes that were found: moved, faint, missing and foreign ones, and the lowest of very many."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.diagnosis.observables.plate.modes import ModeLines, candidate_plates, matched
from pyroshock.diagnosis.observables.plate.spectra import RingingWindow
from pyroshock.diagnosis.observables.plate.stage import PlateObservables
from pyroshock.twin.effects import effect
from pyroshock.twin.plate.modal import ModalPlate, PlateEffect
from support.records.plate_records import RATE_HZ, plate, played


def lines(table: ModalPlate) -> ModeLines:
    return ModeLines(table.frequency_hz, np.abs(table.shapes * table.shape_impact).T * table.frequency_hz[:, None])


def of_changed(name: str, **parameters: float) -> np.ndarray:
    change = effect(name, **parameters)
    assert isinstance(change, PlateEffect)
    return matched(lines(change.apply(plate())), [lines(each) for each in candidate_plates(plate())])


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
    found = matched(lines(moved.apply(close)), [lines(each) for each in candidate_plates(close)])
    assert np.array_equal(found, np.arange(10))
    for each in (
        of_changed("plate.stiffness", frequency_factor=0.91),
        of_changed("plate.sensor_mass", mass_kg=0.28),
        of_changed("plate.boundary", support_frequency_hz=145.0),
    ):
        assert np.array_equal(each, np.arange(10))


def test_foreign_and_missing_lines_have_no_mode() -> None:
    own = lines(plate())
    frequency = np.sort(np.append(own.frequency_hz, 2000.0))
    at = int(np.searchsorted(frequency, 2000.0))
    assert own.level is not None
    level = np.insert(own.level, at, 0.3 * own.level.mean(axis=0), axis=0)
    assert np.array_equal(matched(ModeLines(frequency, level), [own]), np.delete(np.arange(11), at))
    assert own.level is not None
    found = ModeLines(np.delete(own.frequency_hz, 3), np.delete(own.level, 3, axis=0))
    named = matched(found, [own])
    assert named[3] == -1
    assert np.array_equal(np.delete(named, 3), np.arange(9))


def dense() -> ModalPlate:
    """Sixty modes about 90 Hz apart, three rigid ones among them, as a finite element model has them."""
    rng = np.random.default_rng(8)
    frequency = np.concatenate([np.zeros(3), 90.0 * (np.arange(57) + 1 + rng.uniform(-0.2, 0.2, 57))])
    shape = rng.uniform(0.25, 0.7, (3, 60)) * rng.choice([-1.0, 1.0], (3, 60))
    ratio = np.where(frequency > 0, 0.003, 0.0)
    return ModalPlate(frequency, ratio, shape[:1], shape[1:], ("#1",), ("acceleration_1", "acceleration_2"))


def test_low_modes_of_a_dense_plate_are_read() -> None:
    planted = effect("plate.stiffness", frequency_factor=1.01)
    stage = PlateObservables(played([planted], noise=0.002, bench=dense()))
    frequency = [i for i, each in enumerate(stage.observables) if "ln frequency" in each.name]
    assert len(frequency) > 5
    assert stage.residuals()[:, frequency] == pytest.approx(np.log(1.01), abs=5e-4)
    left = stage.measured() - stage.simulated([planted])
    assert np.nanmax(np.abs(left / [each.tolerance for each in stage.observables])) < 1.5


def test_window_takes_fewer_samples_and_keeps_the_mode() -> None:
    window = RingingWindow.of(200, 5000, RATE_HZ, 1000.0)
    time = np.arange(5000) / RATE_HZ
    low, high = np.exp(-20 * time) * np.cos(2 * np.pi * 900 * time), np.cos(2 * np.pi * 4000 * time)
    kept = window.start_s + window.step_s * np.arange(window.samples)
    expected = np.exp(-20 * kept) * np.cos(2 * np.pi * 900 * kept)
    assert window.kept.step == 12
    assert window.cut(low + high) == pytest.approx(expected, abs=2e-3)
