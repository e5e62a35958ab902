"""The gun's optional column `impact_position`: another place of the plate, and without it the bench as it was."""

from __future__ import annotations

import hashlib

import numpy as np
import pytest
from pyroshock.virtualbench.campaigns import gun
from pyroshock.virtualbench.effects import Effects
from support.records.bench_shots import GUN_ROW, shot

pytestmark = pytest.mark.usefixtures("coarse_plates")


def channels(**other):
    return shot(Effects.default(), **other).channels


def digest(record):
    return hashlib.sha256(b"".join(record[name].tobytes() for name in sorted(record))).hexdigest()


def test_first_point_is_the_default():
    assert digest(channels()) == digest(channels(impact_position="#1"))
    assert digest(channels()) == digest(channels(impact_position=""))


def test_another_point_shakes_the_plate_otherwise_and_leaves_gun_and_force_alone():
    here, there = channels(), channels(impact_position="#2")
    for name in here:
        same = np.array_equal(here[name], there[name])
        assert same is not name.startswith("acceleration")


def test_point_that_the_plate_has_not_is_refused():
    with pytest.raises(ValueError, match=r"run 3: impact_position is '#4'; expected one of #1, #2, #3"):
        gun.set_up([{**GUN_ROW, "impact_position": "#4"}], Effects.none(), np.random.default_rng(0))
