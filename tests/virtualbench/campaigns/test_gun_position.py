"""The gun's optional column `impact_position`: another place of the plate, and without it the bench as it was."""

from __future__ import annotations

import hashlib

import numpy as np
import pytest
from pyroshock.virtualbench.campaigns import gun, plates
from pyroshock.virtualbench.effects import Effects

ROW = {
    "run": "3",
    "plate_material": "aluminum",
    "anvil_material": "none",
    "insulator": "none",
    "tip_material": "PLA",
    "tip_radius_mm": "30",
    "bullet_mass_kg": "0.2",
    "tank_pressure_bar": "1.5",
}


@pytest.fixture(scope="module", autouse=True)
def coarse_plates():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(plates, "MAX_FREQUENCY_HZ", 500.0)
        yield


def channels(row):
    bench = gun.set_up([row], Effects.default(), np.random.default_rng(0))
    (task,) = bench.tasks([row], 1)
    return bench.take(task, np.random.default_rng(1)).channels


def digest(record):
    return hashlib.sha256(b"".join(record[name].tobytes() for name in sorted(record))).hexdigest()


def test_first_point_is_the_default():
    assert digest(channels(ROW)) == digest(channels({**ROW, "impact_position": "#1"}))
    assert digest(channels(ROW)) == digest(channels({**ROW, "impact_position": ""}))


def test_another_point_shakes_the_plate_otherwise_and_leaves_gun_and_force_alone():
    here, there = channels(ROW), channels({**ROW, "impact_position": "#2"})
    for name in here:
        same = np.array_equal(here[name], there[name])
        assert same is not name.startswith("acceleration")


def test_point_that_the_plate_has_not_is_refused():
    with pytest.raises(ValueError, match=r"run 3: impact_position is '#4'; expected one of #1, #2, #3"):
        gun.set_up([{**ROW, "impact_position": "#4"}], Effects.none(), np.random.default_rng(0))
