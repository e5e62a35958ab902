"""The bench's plate, and the builds that are refused."""

from __future__ import annotations

import math
from dataclasses import replace

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


def test_mass_of_the_two_plates() -> None:
    area = 0.3448  # by triangles: 0.1178 + 0.2270 m^2
    plates = {name: resonant_plate(name, "free", np.random.default_rng(3)) for name in MATERIALS}
    assert PLATE.area_m2 == pytest.approx(area)
    assert {name: plate.mass_kg for name, plate in plates.items()} == pytest.approx(
        {"aluminum": 2700 * 0.01 * area, "steel": 7800 * 0.01 * area}
    )


def test_no_two_sides_or_angles_are_alike() -> None:
    sides = np.roll(OUTLINE_M, -1, axis=0) - np.array(OUTLINE_M)
    lengths = np.sort(np.linalg.norm(sides, axis=1))
    angles = np.sort(np.diff(np.unwrap(np.arctan2(*sides[[0, 1, 2, 3, 0]].T[::-1]))))
    assert np.diff(lengths).min() > 0.03
    assert np.diff(angles).min() > math.radians(5)


def test_damping_is_drawn_between_its_limits() -> None:
    ratios = np.array(PLATE.damping_ratios)
    assert 0.002 <= ratios.min() < 0.0021
    assert 0.0095 < ratios.max() <= 0.01
    assert np.median(ratios) == pytest.approx(math.sqrt(0.002 * 0.01), rel=0.08)


def test_same_seed_same_plate() -> None:
    assert resonant_plate("steel", "free", np.random.default_rng(3)) == PLATE
    assert resonant_plate("steel", "free", np.random.default_rng(4)) != PLATE


def test_boundary_follows_the_clamps() -> None:
    assert PLATE.boundary == "free"
    assert resonant_plate("steel", "fixed", np.random.default_rng(3)).boundary == "fixed"


@pytest.mark.parametrize(
    ("material", "boundary", "name"), [("copper", "free", "'copper'.*aluminum"), ("steel", "hung", "'hung'.*'free'")]
)
def test_unknown_plate_is_refused(material: str, boundary: str, name: str) -> None:
    with pytest.raises(ValueError, match=name):
        resonant_plate(material, boundary, np.random.default_rng(3))


@pytest.mark.parametrize(
    ("change", "name"),
    [
        ({"thickness_m": 0.0}, "thickness_m = 0.0"),
        ({"outline_m": OUTLINE_M[::-1]}, "counter-clockwise"),
        ({"outline_m": ((0.0, 0.0), (1.0, 0.0), (0.2, 0.2), (0.0, 1.0))}, "convex"),
        ({"outline_m": OUTLINE_M[:3]}, "four corners"),
        ({"damping_ratios": (0.1, 1.0)}, "damping_ratios"),
        ({"sensors": (PlateSensor("a", (0.4, 0.3), -0.01),)}, "mass_kg of a = -0.01"),
        ({"springs": (Spring((0.4, 0.3), math.nan),)}, "stiffness_n_m = nan"),
    ],
)
def test_impossible_plate_is_refused(change: dict, name: str) -> None:
    with pytest.raises(ValueError, match=name):
        replace(PLATE, **change)


@pytest.mark.parametrize("numbers", [(0.0, 0.3, 7800.0), (2e11, 0.5, 7800.0), (2e11, 0.3, math.inf)])
def test_impossible_material_is_refused(numbers: tuple[float, float, float]) -> None:
    with pytest.raises(ValueError, match="expected a number"):
        PlateMaterial(*numbers)


@pytest.mark.parametrize(("edge", "start", "stop"), [(4, 0.0, 1.0), (0, 0.5, 0.5), (0, -0.1, 0.5), (0, 0.5, 1.1)])
def test_impossible_clamp_is_refused(edge: int, start: float, stop: float) -> None:
    with pytest.raises(ValueError, match="expected"):
        Clamp(edge, start, stop)
