"""The gun's optional column `chain_height_mm`: the plate hangs higher and is struck lower."""

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
