"""The gun's optional column `valve_profile`: the valve's way of each shot, and without it the bench as it was."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.virtualbench.campaigns import gun
from pyroshock.virtualbench.effects import Effects
from support.records.bench_shots import GUN_ROW, shot

pytestmark = pytest.mark.usefixtures("coarse_plates")


def test_a_valve_that_closes_leaves_pressure_in_the_recorded_tank():
    open_, closing = (shot(Effects.default(), **row) for row in ({}, {"valve_profile": "0:0 0.25:1 0.3:1 0.35:0"}))
    bar = [(take.channels["tank_pressure"] - 0.3624) / 0.5621 for take in (open_, closing)]
    end = slice(-1000, None)
    assert bar[1][end].mean() > bar[0][end].mean() + 0.05
    assert bar[1][:1000].mean() == pytest.approx(bar[0][:1000].mean(), abs=0.005)


def test_a_text_that_is_no_profile_is_refused():
    with pytest.raises(ValueError, match=r"run 3: valve_profile is '0-1'; expected points TIME:POSITION"):
        gun.set_up([{**GUN_ROW, "valve_profile": "0-1"}], Effects.none(), np.random.default_rng(0))
