"""The plate of the bench and its modes: rigid ones, normalisation, what each effect does to them,
their table."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.polynomial import legendre
from pyroshock.ingest.folder.modal_table import read_modal_table
from pyroshock.virtualbench.effects import Effects
from pyroshock.virtualbench.plate.build import (
    MATERIALS,
    OUTLINE_M,
    BenchPlate,
    Clamp,
    PlateMaterial,
    PlateSensor,
    Spring,
    resonant_plate,
)
from pyroshock.virtualbench.plate.mesh import Mesh, bilinear
from pyroshock.virtualbench.plate.modes import (
    PlateModes,
    assemble,
    lowest_modes,
    modal_table,
    modes,
)
from scipy.linalg import eigh

LIMIT_HZ = 1500.0
NONE = Effects.none()


def _plate(boundary: str = "free") -> BenchPlate:
    return resonant_plate("aluminum", boundary, np.random.default_rng(7))


def _solved(plate: BenchPlate, effects: Effects = NONE) -> PlateModes:
    return modes(plate, effects, max_frequency_hz=LIMIT_HZ)


def _grid(plate: BenchPlate) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 2) and the masses (n,) that stand for the plate at them, by Gauss's rule."""
    points, weights = legendre.leggauss(14)
    u, v = np.repeat((points + 1) / 2, 14), np.tile((points + 1) / 2, 14)
    position, slopes = bilinear(np.array(plate.outline_m), u, v)
    density = plate.material.density_kg_m3 * plate.thickness_m
    return position, density * np.outer(weights, weights).ravel() / 4 * np.linalg.det(slopes)


def _rigid_receptance(plate: BenchPlate, at: np.ndarray, hit: np.ndarray) -> np.ndarray:
    """Acceleration per force of the plate as a rigid body, by Newton and Euler, rotary inertia h^2
    / 12 included."""
    position, mass = _grid(plate)
    centre = mass @ position / mass.sum()
    arm = position - centre
    second = (arm * mass[:, None]).T @ arm + mass.sum() * plate.thickness_m**2 / 12 * np.eye(2)
    return 1 / mass.sum() + (at - centre) @ np.linalg.solve(second, hit - centre)


def test_three_rigid_modes_obey_newton_and_euler_and_a_clamped_plate_has_none() -> None:
    plate = _plate()
    solved = _solved(plate)
    assert solved.frequencies_hz[:3].tolist() == [0.0, 0.0, 0.0]
    assert solved.frequencies_hz[3] > 50
    assert np.all(np.diff(solved.frequencies_hz[3:]) > 0)
    sensors = np.array([sensor.position_m for sensor in plate.sensors])
    for k, point in enumerate(plate.impact_points_m):
        expected = _rigid_receptance(plate, sensors, np.array(point))
        assert solved.shapes[:, :3] @ solved.shape_impact[k, :3] == pytest.approx(
            expected, rel=1e-6
        )
    assert _solved(_plate("fixed")).frequencies_hz[0] > 50


def test_shapes_are_orthonormal_in_mass_and_give_the_mobility_of_an_endless_plate() -> None:
    plate = _plate()
    position, mass = _grid(plate)
    watched = replace(
        plate, sensors=tuple(PlateSensor(f"{k}", tuple(p)) for k, p in enumerate(position.tolist()))
    )
    shapes = _solved(watched).shapes[:, :16]
    # Rotary inertia holds the little that is missing: k^2 h^2 / 12 of a mode with wavenumber k.
    assert (shapes * mass[:, None]).T @ shapes == pytest.approx(np.eye(16), abs=5e-3)
    interior = tuple((x, y) for x in (0.40, 0.45, 0.5, 0.55) for y in (0.22, 0.27, 0.32))
    limit = 8000.0
    solved = modes(
        replace(plate, impact_points_m=interior, sensors=()), NONE, max_frequency_hz=limit
    )
    endless = 1 / (
        8 * math.sqrt(plate.rigidity_n_m * plate.material.density_kg_m3 * plate.thickness_m)
    )
    mean = math.pi / 2 * (solved.shape_impact**2).sum(axis=1) / (2 * math.pi * limit)
    assert mean.mean() == pytest.approx(endless, rel=0.1)


def test_modulus_raises_frequencies_as_stated_and_as_rayleigh_says() -> None:
    nominal = modes(_plate(), NONE, max_frequency_hz=8000.0).frequencies_hz[3:]
    stiffer = modes(
        _plate(), Effects.only("plate.stiffness", 3.0), max_frequency_hz=8400.0
    ).frequencies_hz[3:]
    rise = stiffer[: nominal.size] / nominal - 1
    assert rise.mean() == pytest.approx(0.03, abs=0.002)
    assert 0.001 < rise.std() < 0.01
    # Half of the added strain energy over the whole: Theory of Sound I, section 88.
    plate = _plate()
    mesh = Mesh.regular(plate.outline_m, 4, 4, 8, ())
    even, mass = assemble(mesh, plate.material, plate.thickness_m)
    more, same = assemble(mesh, plate.material, plate.thickness_m, 1e-3)
    assert abs(mass - same).max() == 0
    frequencies, shapes = lowest_modes(even, mass, 12, shift_hz=50.0)
    stiffer, _ = lowest_modes(more, mass, 12, shift_hz=50.0)
    shapes = shapes[:, 3:]
    expected = (
        np.sum(shapes * (more @ shapes), axis=0) / np.sum(shapes * (even @ shapes), axis=0) - 1
    )
    assert np.ptp(expected) > 1e-4
    assert 2 * (stiffer[3:] / frequencies[3:] - 1) == pytest.approx(expected, rel=0.01)


@pytest.mark.parametrize("count", [12, 30, 120, 300])
def test_lowest_modes_are_those_of_the_whole_matrices(count: int) -> None:
    """A fixed square, which has modes in pairs, by LAPACK."""
    plate = _plate()
    mesh = Mesh.regular(((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)), 2, 2, 8, ())
    stiffness, mass = assemble(mesh, plate.material, plate.thickness_m)
    stiffness = stiffness + 1e4 * mass  # on a bed that holds it
    frequencies, shapes = lowest_modes(stiffness, mass, count, shift_hz=30.0)
    squares, vectors = eigh(stiffness.toarray(), mass.toarray(), subset_by_index=[0, count + 4])
    expected = np.sqrt(squares[:count]) / (2 * np.pi)
    np.testing.assert_allclose(frequencies, expected, rtol=1e-6)
    np.testing.assert_allclose(frequencies[10:], expected[10:], rtol=1e-9)
    np.testing.assert_allclose(shapes.T @ (mass @ shapes), np.eye(count), atol=1e-10)
    # Of a pair any combination is a mode.
    np.testing.assert_allclose(vectors @ (vectors.T @ (mass @ shapes)), shapes, atol=1e-7)


def test_sensors_lower_frequencies_and_small_ones_as_rayleigh_says() -> None:
    plate = _plate()
    light = Effects.only("plate.sensor_mass", 0.01)
    nominal, loaded = _solved(plate), _solved(plate, light)
    mass = np.array([0.01 * sensor.mass_kg for sensor in plate.sensors])
    expected = -(mass @ nominal.shapes[:, 3:] ** 2) / 2
    assert loaded.frequencies_hz[3:] / nominal.frequencies_hz[3:] - 1 == pytest.approx(
        expected, rel=0.05, abs=2e-6
    )
    nominal, loaded = _solved(_plate()), _solved(_plate(), Effects.only("plate.sensor_mass"))
    fall = 1 - loaded.frequencies_hz[3:] / nominal.frequencies_hz[3 : loaded.frequencies_hz.size]
    assert fall.min() > 0
    assert 1e-3 < fall.max() < 2e-2


def test_suspension_carries_the_rigid_plate() -> None:
    plate = _plate()
    solved = _solved(plate, Effects.only("plate.boundary", 0.01))
    points = np.array([spring.position_m for spring in plate.springs])
    stiffness = np.array([0.01 * spring.stiffness_n_m for spring in plate.springs])
    flexibility = np.array([_rigid_receptance(plate, points, point) for point in points])
    squares = np.sort(np.linalg.eigvals(flexibility * stiffness).real)
    assert solved.frequencies_hz[:3] == pytest.approx(np.sqrt(squares) / (2 * np.pi), rel=1e-3)


@pytest.mark.parametrize("boundary", ["free", "fixed"])
def test_supports_raise_the_low_modes_most(boundary: str) -> None:
    nominal, held = (
        _solved(_plate(boundary)),
        _solved(_plate(boundary), Effects.only("plate.boundary", 5.0)),
    )
    first = 3 if boundary == "free" else 0
    count = min(nominal.frequencies_hz.size, held.frequencies_hz.size)
    rise = held.frequencies_hz[first:count] / nominal.frequencies_hz[first:count] - 1
    assert rise.min() > 0
    assert rise[:3].mean() > 10 * rise[-10:].mean()


def test_damping_is_the_plate_s_and_other_stages_leave_it_alone() -> None:
    plate = _plate()
    nominal, damped = _solved(plate), _solved(plate, Effects.only("plate.damping", 4.0))
    assert nominal.damping.tolist() == list(plate.damping_ratios[: nominal.damping.size])
    rise = 0.4 * (nominal.frequencies_hz / 2000.0) ** 0.3
    assert damped.damping == pytest.approx((1 + rise) * nominal.damping)
    assert damped.frequencies_hz is nominal.frequencies_hz  # solved once
    other = Effects.default()
    for name in ("plate.damping", "plate.stiffness", "plate.sensor_mass", "plate.boundary"):
        other = other.with_strength(name, 0.0)
    assert np.array_equal(_solved(_plate(), other).shapes, _solved(_plate()).shapes)
    with pytest.raises(ValueError, match="read-only"):
        _solved(_plate()).shapes[0, 0] = 1.0


def test_effects_plates_and_limits_without_a_meaning_are_refused() -> None:
    for name, strength, words in (
        ("plate.boundary", -1.0, "plate.boundary"),
        ("plate.stiffness", -100.0, "plate.stiffness"),
        ("plate.damping", -12.0, "plate.damping"),
        ("plate.damping", 1e4, r"under plate\.damping"),
    ):
        with pytest.raises(ValueError, match=words):
            _solved(_plate(), Effects.only(name, strength))
    with pytest.raises(ValueError, match="damping_ratios has 5 values"):
        _solved(replace(_plate(), damping_ratios=(0.01,) * 5))
    with pytest.raises(ValueError, match="off the plate"):
        _solved(replace(_plate(), sensors=(PlateSensor("lost", (0.0, 0.6)),)))
    for limit in (0.0, -1.0, math.nan):
        with pytest.raises(ValueError, match="max_frequency_hz"):
            modes(_plate(), NONE, max_frequency_hz=limit)


def test_ingest_reads_every_number_back(tmp_path: Path) -> None:
    """The modal table, read back by the reader of campaign folders."""
    plate = resonant_plate("steel", "free", np.random.default_rng(2))
    solved = modes(plate, Effects.none(), max_frequency_hz=500.0)
    (tmp_path / "plate_modes.csv").write_text(modal_table(solved, 1))
    read = read_modal_table(tmp_path, "plate_modes.csv", ("acceleration_1", "acceleration_2")).modes
    assert [row.frequency_hz for row in read] == solved.frequencies_hz.tolist()
    assert [row.damping_ratio for row in read] == solved.damping.tolist()
    assert [row.shape_impact for row in read] == solved.shape_impact[1].tolist()
    assert [row.shapes["acceleration_2"] for row in read] == solved.shapes[1].tolist()
    for point in (-1, 3):
        with pytest.raises(ValueError, match=f"point = {point}"):
            modal_table(solved, point)


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
        (
            partial(replace, PLATE, outline_m=((0.0, 0.0), (1.0, 0.0), (0.2, 0.2), (0.0, 1.0))),
            "convex",
        ),
        (partial(replace, PLATE, outline_m=OUTLINE_M[:3]), "four corners"),
        (partial(replace, PLATE, damping_ratios=(0.1, 1.0)), "damping_ratios"),
        (
            partial(replace, PLATE, sensors=(PlateSensor("a", (0.4, 0.3), -0.01),)),
            "mass_kg of a = -0.01",
        ),
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
