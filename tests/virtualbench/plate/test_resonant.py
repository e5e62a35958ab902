"""The bench's plate, and the builds that are refused."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest
from pyroshock.virtualbench.plate.build import (
    MATERIALS,
    OUTLINE_M,
    Clamp,
    PlateMaterial,
    PlateSensor,
    Spring,
    resonant_plate,
)

PLATE = resonant_plate("steel", "free", np.random.default_rng(3))


def test_plates_are_drawn_by_seed_with_sides_angles_and_damping_of_their_own() -> None:
    area = 0.3448  # by triangles: 0.1178 + 0.2270 m^2
    plates = {name: resonant_plate(name, "free", np.random.default_rng(3)) for name in MATERIALS}
    assert PLATE.area_m2 == pytest.approx(area)
    assert {name: plate.mass_kg for name, plate in plates.items()} == pytest.approx(
        {"aluminum": 2700 * 0.01 * area, "steel": 7800 * 0.01 * area}
    )
    assert plates["steel"] == PLATE != resonant_plate("steel", "free", np.random.default_rng(4))
    assert PLATE.boundary == "free"
    assert resonant_plate("steel", "fixed", np.random.default_rng(3)).boundary == "fixed"
    sides = np.roll(OUTLINE_M, -1, axis=0) - np.array(OUTLINE_M)
    lengths = np.sort(np.linalg.norm(sides, axis=1))
    angles = np.sort(np.diff(np.unwrap(np.arctan2(*sides[[0, 1, 2, 3, 0]].T[::-1]))))
    assert np.diff(lengths).min() > 0.03
    assert np.diff(angles).min() > math.radians(5)
    ratios = np.array(PLATE.damping_ratios)
    assert 0.002 <= ratios.min() < 0.0021
    assert 0.0095 < ratios.max() <= 0.01
    assert np.median(ratios) == pytest.approx(math.sqrt(0.002 * 0.01), rel=0.08)


@pytest.mark.parametrize(
    ("refused", "words"),
    [
        (partial(resonant_plate, "copper", "free", np.random.default_rng(3)), "'copper'.*aluminum"),
        (partial(resonant_plate, "steel", "hung", np.random.default_rng(3)), "'hung'.*'free'"),
        (partial(replace, PLATE, thickness_m=0.0), "thickness_m = 0.0"),
        (partial(replace, PLATE, outline_m=OUTLINE_M[::-1]), "counter-clockwise"),
        (partial(replace, PLATE, outline_m=((0.0, 0.0), (1.0, 0.0), (0.2, 0.2), (0.0, 1.0))), "convex"),
        (partial(replace, PLATE, outline_m=OUTLINE_M[:3]), "four corners"),
        (partial(replace, PLATE, damping_ratios=(0.1, 1.0)), "damping_ratios"),
        (partial(replace, PLATE, sensors=(PlateSensor("a", (0.4, 0.3), -0.01),)), "mass_kg of a = -0.01"),
        (partial(replace, PLATE, springs=(Spring((0.4, 0.3), math.nan),)), "stiffness_n_m = nan"),
        (partial(PlateMaterial, 0.0, 0.3, 7800.0), "expected a number"),
        (partial(PlateMaterial, 2e11, 0.5, 7800.0), "expected a number"),
        (partial(PlateMaterial, 2e11, 0.3, math.inf), "expected a number"),
        (partial(Clamp, 4, 0.0, 1.0), "expected"),
        (partial(Clamp, 0, 0.5, 0.5), "expected"),
        (partial(Clamp, 0, -0.1, 0.5), "expected"),
        (partial(Clamp, 0, 0.5, 1.1), "expected"),
    ],
)
def test_impossible_plates_materials_and_clamps_are_refused(refused: Any, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        refused()
