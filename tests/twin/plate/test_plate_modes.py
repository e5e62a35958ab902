"""Modes from an outline: published figures, closed forms, what a plate does not depend on, and
plates on disk."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pyroshock.twin.plate import modes
from pyroshock.twin.plate.build import (
    PlateBuild,
    PointMass,
    PointSpring,
    RayleighDamping,
    named_points,
)
from pyroshock.twin.plate.fem import elements_of
from pyroshock.twin.plate.modes import solve_plate
from pyroshock.twin.plate.outline import Clamped, SimplySupported
from pyroshock.twin.setting import THESIS, ElasticMaterial

SQUARE = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))
ELL = ((0.0, 0.0), (1.0, 0.0), (1.0, 0.4), (0.5, 0.4), (0.5, 0.8), (0.0, 0.8))
STEEL = ElasticMaterial("steel", 200e9, 0.3, 7800.0)
THIN = 0.005


def build(outline=SQUARE, **fields):
    fields = {"thickness_m": THIN, "material": STEEL, **fields}
    return PlateBuild(
        outline_m=outline,
        impact_points=named_points({"#1": (0.3, 0.35), "#2": (0.1, 0.15)}),
        sensors=named_points({"a": (0.9, 0.3), "b": (0.0, 0.0)}),
        **fields,
    )


def kirchhoff(plate, top=30.0, **more):
    """omega a^2 sqrt(rho h / D) of the modes up to a value of that."""
    unit = np.sqrt(plate.rigidity_n_m / plate.mass_per_area_kg_m2) / (2 * np.pi)
    return solve_plate(plate, top * unit, thickness_correction=False, **more).frequency_hz / unit


def test_free_and_simply_supported_squares_have_their_published_frequencies():
    found = kirchhoff(build(), 40.0)
    assert np.all(found[:3] == 0)
    np.testing.assert_allclose(found[3:8], [13.468, 19.596, 24.270, 34.801, 34.801], rtol=1e-4)
    found = kirchhoff(build(edges=tuple(SimplySupported(side) for side in range(4))), 140.0)
    squares = sorted(i**2 + j**2 for i in range(1, 6) for j in range(1, 6))
    np.testing.assert_allclose(found, np.pi**2 * np.array(squares[: found.size]), rtol=1e-5)


@pytest.mark.slow
def test_clamped_and_cantilever_squares_have_the_published_frequencies():
    # Leissa, NASA SP-160 (1969), tables 4.24 and 4.54 (Barton 1951), the latter an upper bound.
    clamped = kirchhoff(build(edges=tuple(Clamped(side) for side in range(4))), 133.0)
    np.testing.assert_allclose(clamped, [35.992, 73.413, 73.413, 108.27, 131.64, 132.24], rtol=6e-4)
    cantilever = kirchhoff(build(edges=(Clamped(0),)), 32.0)
    np.testing.assert_allclose(cantilever, [3.494, 8.547, 21.44, 27.46, 31.17], rtol=1e-2)
    assert cantilever[0] < 3.494


def test_start_and_sense_of_the_outline_do_not_matter():
    square_modes = solve_plate(build(SQUARE), 60.0)
    for outline in (SQUARE[2:] + SQUARE[:2], SQUARE[::-1]):
        other = solve_plate(build(outline), 60.0)
        np.testing.assert_array_equal(square_modes.frequency_hz, other.frequency_hz)
        np.testing.assert_array_equal(square_modes.shapes, other.shapes)


@pytest.mark.slow
def test_a_turned_and_shifted_plate_has_the_same_frequencies():
    turn = np.array([[np.cos(0.4), -np.sin(0.4)], [np.sin(0.4), np.cos(0.4)]])
    moved = PlateBuild(
        tuple(map(tuple, (np.array(ELL) @ turn.T + (3, -2)).tolist())),
        THIN,
        STEEL,
        named_points({"#1": tuple(turn @ (0.3, 0.35) + (3, -2))}),
        named_points({"a": tuple(turn @ (0.1, 0.7) + (3, -2))}),
    )
    np.testing.assert_allclose(
        solve_plate(moved, 150.0).frequency_hz,
        solve_plate(build(ELL), 150.0).frequency_hz,
        rtol=1e-3,
    )


@pytest.mark.slow
def test_rayleigh_quotients_converge_from_above_by_the_eighth_power():
    held = build(edges=tuple(SimplySupported(side) for side in range(4)))
    squares = sorted(i**2 + j**2 for i in range(1, 12) for j in range(1, 12))
    errors = [
        kirchhoff(held, 600.0, elements_per_wavelength=n)[30] / (np.pi**2 * squares[30]) - 1
        for n in (1.05, 2.1)
    ]
    assert errors[0] > errors[1] > 0
    assert np.log2(errors[0] / errors[1]) > 6


def test_shapes_are_orthonormal_and_matrices_symmetric():
    elements = elements_of(build(ELL, masses=(PointMass((0.2, 0.2), 1.0),)), 0.25, 0.001)
    for matrix in (elements.stiffness, elements.mass):
        assert abs(matrix - matrix.T).max() < 1e-12 * abs(matrix).max()
    # A rigid plate: 1' M 1 is its mass, and nothing resists it.
    one = np.zeros(elements.basis.N)
    one[elements.basis.nodal_dofs[0]] = 1.0
    assert one @ elements.mass @ one == pytest.approx(build(ELL).mass_kg + 1.0)
    assert abs(elements.stiffness @ one).max() < 1e-6 * abs(elements.stiffness).max()


def test_rigid_shapes_hold_the_mass_soft_springs_carry_it_and_a_law_of_damping_is_followed():
    free = solve_plate(build(), 20.0)
    rigid = np.vstack([free.shape_impact, free.shapes])[:, :3]
    plate = build()
    # sum of rigid shapes squared = 1/m + r^2 / J at a distance r from the middle, J = m a^2 / 12.
    points = np.array([place.position_m for place in (*plate.impact_points, *plate.sensors)]) - 0.5
    expected = (1 + 12 * np.sum(points**2, axis=1)) / plate.mass_kg
    np.testing.assert_allclose(np.sum(rigid**2, axis=1), expected, rtol=1e-6)
    k, plate = 50.0, build()
    held = replace(plate, springs=tuple(PointSpring(corner, k) for corner in SQUARE))
    found = solve_plate(held, 5.0).frequency_hz
    # Up: 4 k / m; tilting: 4 k (a/2)^2 / (m a^2 / 12) = 12 k / m.
    expected = np.sqrt(np.array([4, 12, 12]) * k / plate.mass_kg) / (2 * np.pi)
    np.testing.assert_allclose(found[:3], expected, rtol=1e-3)
    law = RayleighDamping(50.0, 0.01, 200.0, 0.02)
    np.testing.assert_allclose(law.ratios(np.array([0.0, 50.0, 200.0])), [0.0, 0.01, 0.02])
    free = solve_plate(build(damping=law), 100.0)
    np.testing.assert_array_equal(free.damping_ratio, law.ratios(free.frequency_hz))


@pytest.mark.slow
def test_one_spring_leaves_two_rigid_modes_and_a_heavy_mass_is_a_support():
    sprung = solve_plate(build(springs=(PointSpring((0.5, 0.5), 1e3),)), 30.0).frequency_hz
    assert np.all(sprung[:2] == 0)
    assert sprung[2] > 0.5
    heavy = solve_plate(build(masses=(PointMass((0.5, 0.5), 1e7),)), 60.0).frequency_hz
    stiff = solve_plate(build(springs=(PointSpring((0.5, 0.5), 1e12),)), 60.0).frequency_hz
    np.testing.assert_allclose(heavy[heavy > 1], stiff[stiff > 1], rtol=1e-4)


@pytest.mark.slow
def test_no_edge_and_a_whole_stretch_are_the_limits_of_a_part():
    tops = [
        kirchhoff(build(edges=edges), 12.0) for edges in ((Clamped(0, 0.0, 0.5),), (Clamped(0),))
    ]
    assert np.all(tops[0][:2] < tops[1][:2])
    assert tops[0][0] > 0


@pytest.mark.slow
def test_thick_simply_supported_plates_have_mindlins_closed_form():
    from pyroshock.twin.plate.modes import kirchhoff_hz, mindlin_hz

    # omega a sqrt(rho / G), h/a = 0.1, nu = 0.3: Dawe and Roufaeil, J. Sound Vib. 69 (1980) 345.
    thick = build(thickness_m=0.1, edges=tuple(SimplySupported(side) for side in range(4)))
    speed = np.sqrt(200e9 / 2.6 / 7800)
    found = solve_plate(thick, 4500.0).frequency_hz * 2 * np.pi / speed
    np.testing.assert_allclose(found[:4], [0.930, 2.219, 2.219, 3.406], rtol=2e-3)
    assert mindlin_hz(thick, np.array([kirchhoff_hz(thick, 3e3)]))[0] == pytest.approx(
        3e3, rel=1e-12
    )


@pytest.mark.slow
def test_thin_plates_need_no_correction():
    thin = build(thickness_m=1e-5)
    top = 0.1
    exact, corrected = (
        solve_plate(thin, top, thickness_correction=given).frequency_hz for given in (False, True)
    )
    np.testing.assert_allclose(corrected[3:], exact[3:], rtol=1e-4)


@pytest.mark.parametrize(
    ("outline", "message"),
    [
        (((0, 0), (1, 1), (1, 0), (0, 1)), "cross"),
        (((0, 0), (1, 0)), "three corners"),
        (((0, 0), (1, 0), (0.5, 0)), "fold back"),
        (((0, 0), (1, 0), (1, 0), (0, 1)), "fold back"),
    ],
)
def test_outlines_that_are_no_polygon_and_points_off_the_plate_are_refused(outline, message):
    with pytest.raises(ValueError, match=message):
        build(outline)
    with pytest.raises(ValueError, match="off the plate"):  # within the triangle's bounds
        solve_plate(replace(BUILD, sensors=named_points({"a": (0.1, 0.3)})), 30.0)


@pytest.mark.slow
def test_the_virtual_bench_has_the_same_frequencies():
    """An independent Mindlin model of degree eight, free edges, 10 mm: the worst case of the
    correction."""
    from pyroshock.virtualbench.effects import Effects
    from pyroshock.virtualbench.plate.build import OUTLINE_M, resonant_plate
    from pyroshock.virtualbench.plate.modes import modes

    peer = modes(
        resonant_plate("aluminum", "free", np.random.default_rng(0)),
        Effects.none(),
        max_frequency_hz=10e3,
    )
    ours = build(OUTLINE_M, thickness_m=0.01, material=THESIS["aluminum"])
    ours = replace(ours, sensors=named_points({"a": (0.22, 0.20), "b": (0.73, 0.37)}))
    solved = solve_plate(replace(ours, impact_points=named_points({"#1": (0.47, 0.28)})), 10e3)
    elastic = slice(3, min(solved.frequency_hz.size, peer.frequencies_hz.size))
    error = solved.frequency_hz[elastic] / peer.frequencies_hz[elastic] - 1
    assert np.max(np.abs(error)) < 4e-3
    low = slice(3, 13)
    np.testing.assert_allclose(
        np.abs(solved.shapes[:, low]), np.abs(peer.shapes[:, low]), atol=0.02
    )


BUILD = PlateBuild(
    ((0.0, 0.0), (0.5, 0.0), (0.4, 0.4)),
    0.01,
    THESIS["steel"],
    named_points({"#1": (0.3, 0.1)}),
    named_points({"a": (0.35, 0.2)}),
)


@pytest.fixture
def solutions(monkeypatch):
    solve, seen = solve_plate, []

    def counted(*arguments, **more):
        seen.append(arguments)
        return solve(*arguments, **more)

    monkeypatch.setattr(modes, "solve_plate", counted)
    return seen


def test_a_plate_is_solved_once(tmp_path, solutions):
    first, again = (modes.cached_plate(BUILD, 500.0, tmp_path / "deep" / "er") for _ in range(2))
    assert len(solutions) == 1
    for name in ("frequency_hz", "damping_ratio", "shape_impact", "shapes"):
        np.testing.assert_array_equal(getattr(first, name), getattr(again, name))
    assert (again.impact_points, again.sensors) == (("#1",), ("a",))
    assert {BUILD: 1}[replace(BUILD)] == 1


@pytest.mark.slow
def test_another_plate_is_another_file(tmp_path, solutions):
    for build in (BUILD, replace(BUILD, thickness_m=0.011)):
        modes.cached_plate(build, 500.0, tmp_path)
    modes.cached_plate(BUILD, 400.0, tmp_path)
    modes.cached_plate(BUILD, 400.0, tmp_path, thickness_correction=False)
    assert len(solutions) == 4 == len(list(tmp_path.iterdir()))


def test_a_damaged_file_is_solved_anew(tmp_path, solutions):
    good = modes.cached_plate(BUILD, 500.0, tmp_path)
    (file,) = tmp_path.iterdir()
    for times, damage in enumerate((b"", b"no archive", file.read_bytes()[:-200]), 2):
        file.write_bytes(damage)
        for _ in range(2):
            np.testing.assert_array_equal(
                modes.cached_plate(BUILD, 500.0, tmp_path).shapes, good.shapes
            )
            assert len(solutions) == times
