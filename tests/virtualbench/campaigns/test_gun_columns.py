"""The optional columns of the gun: height of the chains, place of impact, and the way of the valve."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.virtualbench.campaigns import gun
from pyroshock.virtualbench.campaigns.gun import POSITIONS
from pyroshock.virtualbench.effects import Effects
from support.records.bench_shots import GUN_ROW, shot

pytestmark = pytest.mark.usefixtures("coarse_plates")


def test_another_height_shakes_the_plate_otherwise_and_leaves_gun_and_force_alone():
    here, same, there = (shot(Effects.default(), chain_height_mm=text).channels for text in ("", "0", "112"))
    for name in here:
        assert np.array_equal(here[name], same[name])
        assert np.array_equal(here[name], there[name]) is not name.startswith("acceleration")


def test_shapes_of_the_struck_point_are_those_below_it():
    bench = gun.set_up([GUN_ROW, {**GUN_ROW, "chain_height_mm": "56"}], Effects.none(), np.random.default_rng(0))
    (plate,) = bench.plates.values()
    usual, lower = plate.shape_impact[: len(POSITIONS)], plate.shape_impact[len(POSITIONS) :]
    assert usual.shape == lower.shape
    assert bench.heights_m == (0.0, pytest.approx(0.056))
    rigid = np.flatnonzero(plate.frequencies_hz < 1.0)
    assert rigid.size >= 3
    # Rigid modes are planes: 56 mm lower they differ by the slope that two other points have between them.
    points = np.array([[0.47, 0.28], [0.31, 0.37], [0.68, 0.22]])
    planes = np.linalg.solve(np.column_stack([points, np.ones(3)]), usual[:, rigid])
    np.testing.assert_allclose(usual[:, rigid] - lower[:, rigid], np.tile(0.056 * planes[1], (3, 1)), atol=1e-6)


@pytest.mark.parametrize(("text", "words"), [("50", "expected a multiple of 56"), ("560", "the bullet misses")])
def test_a_height_that_the_chains_do_not_have_is_refused(text, words):
    with pytest.raises(ValueError, match=rf"run 3: chain_height_mm is '{text}'.*{words}"):
        gun.set_up([{**GUN_ROW, "chain_height_mm": text}], Effects.none(), np.random.default_rng(0))


def test_another_point_shakes_the_plate_otherwise_and_the_first_is_the_default():
    """`impact_position`: gun and force are left alone, and without it the bench is as it was."""
    usual, first, empty, second = (
        shot(Effects.default(), **row).channels for row in ({}, *({"impact_position": p} for p in ("#1", "", "#2")))
    )
    for name in usual:
        assert np.array_equal(usual[name], first[name]) and np.array_equal(usual[name], empty[name])
        assert np.array_equal(usual[name], second[name]) is not name.startswith("acceleration")
    with pytest.raises(ValueError, match=r"run 3: impact_position is '#4'; expected one of #1, #2, #3"):
        gun.set_up([{**GUN_ROW, "impact_position": "#4"}], Effects.none(), np.random.default_rng(0))


def test_a_valve_that_closes_leaves_pressure_in_the_recorded_tank():
    # `valve_profile`: the way of the valve of each shot
    open_, closing = (shot(Effects.default(), **row) for row in ({}, {"valve_profile": "0:0 0.25:1 0.3:1 0.35:0"}))
    bar = [(take.channels["tank_pressure"] - 0.3624) / 0.5621 for take in (open_, closing)]
    end = slice(-1000, None)
    assert bar[1][end].mean() > bar[0][end].mean() + 0.05
    assert bar[1][:1000].mean() == pytest.approx(bar[0][:1000].mean(), abs=0.005)
    with pytest.raises(ValueError, match=r"run 3: valve_profile is '0-1'; expected points TIME:POSITION"):
        gun.set_up([{**GUN_ROW, "valve_profile": "0-1"}], Effects.none(), np.random.default_rng(0))
