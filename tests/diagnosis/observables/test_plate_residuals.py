"""Spectra and records side by side, for what looks for a gap in time and frequency."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.diagnosis.observables.plate.residuals import plate_residuals
from pyroshock.diagnosis.observables.plate.stage import PlateStage
from pyroshock.twin.effects import effect
from support.records.plate_records import played

GAIN = effect("sensor.acceleration_gain", gain=10 ** (4 / 20))


@pytest.fixture(scope="module")
def stage() -> PlateStage:
    return PlateStage(played([GAIN]))


def test_gap_in_db_is_the_gain(stage: PlateStage) -> None:
    assert plate_residuals(stage).gap_db == pytest.approx(4.0, abs=0.15)


def test_share_within_counts_lines(stage: PlateStage) -> None:
    found = plate_residuals(stage)
    assert (found.share_within(3.0), found.share_within(6.0)) == (0.0, 1.0)


def test_effect_closes_the_records(stage: PlateStage) -> None:
    found = plate_residuals(stage, [GAIN])
    assert np.abs(found.measured - found.simulated).max() < 0.03 * np.abs(found.measured).max()
    assert found.share_within(3.0) == 1.0


def test_shapes_agree(stage: PlateStage) -> None:
    found = plate_residuals(stage)
    runs = len(stage.record.runs)
    assert found.measured_db.shape == found.simulated_db.shape == (runs, 2, found.frequency_hz.size)
    assert found.measured.shape == found.simulated.shape
    assert found.first_s.shape == (runs,)
