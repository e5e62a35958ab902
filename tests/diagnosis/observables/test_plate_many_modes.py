"""A plate with more modes than a record can tell apart: the lowest are compared, at a rate that serves them."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.diagnosis.observables.plate.spectra import RingingWindow
from pyroshock.diagnosis.observables.plate.stage import PlateObservables
from pyroshock.twin.effects import effect
from pyroshock.twin.plate.modal import ModalPlate
from support.records.plate_records import RATE_HZ, played


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
