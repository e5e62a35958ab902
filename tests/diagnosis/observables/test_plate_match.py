"""Naming the modes that were found: moved, faint, missing and foreign ones."""

from __future__ import annotations

import numpy as np
from pyroshock.diagnosis.observables.plate.modes import ModeLines, candidate_plates, matched
from pyroshock.twin.effects import effect
from pyroshock.twin.plate.modal import ModalPlate, PlateEffect
from support.records.plate_records import plate


def lines(table: ModalPlate) -> ModeLines:
    return ModeLines(table.frequency_hz, np.abs(table.shapes * table.shape_impact).T * table.frequency_hz[:, None])


def of_changed(name: str, **parameters: float) -> np.ndarray:
    change = effect(name, **parameters)
    assert isinstance(change, PlateEffect)
    return matched(lines(change.apply(plate())), [lines(each) for each in candidate_plates(plate())])


def test_same_plate_is_itself() -> None:
    assert np.array_equal(matched(lines(plate()), [lines(plate())]), np.arange(10))


def test_modes_are_named_though_they_passed_their_neighbours_place() -> None:
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


def test_stiffer_heavier_and_held_plates_are_recognised() -> None:
    for each in (
        of_changed("plate.stiffness", frequency_factor=0.91),
        of_changed("plate.sensor_mass", mass_kg=0.28),
        of_changed("plate.boundary", support_frequency_hz=145.0),
    ):
        assert np.array_equal(each, np.arange(10))


def test_foreign_line_is_left_out() -> None:
    own = lines(plate())
    frequency = np.sort(np.append(own.frequency_hz, 2000.0))
    at = int(np.searchsorted(frequency, 2000.0))
    assert own.level is not None
    level = np.insert(own.level, at, 0.3 * own.level.mean(axis=0), axis=0)
    assert np.array_equal(matched(ModeLines(frequency, level), [own]), np.delete(np.arange(11), at))


def test_mode_that_is_not_heard_has_no_line() -> None:
    own = lines(plate())
    assert own.level is not None
    found = ModeLines(np.delete(own.frequency_hz, 3), np.delete(own.level, 3, axis=0))
    named = matched(found, [own])
    assert named[3] == -1
    assert np.array_equal(np.delete(named, 3), np.arange(9))
