"""What a plate's modes are made of, piece by piece: thickness, damping, held edges, places and
outlines."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from pyroshock.twin.plate.build import (
    ConstantDamping,
    NamedPoint,
    PlateBuild,
    PointMass,
    PointSpring,
    RayleighDamping,
    named_points,
)
from pyroshock.twin.plate.fem import _across_along, _located, elements_of, on_stretch
from pyroshock.twin.plate.mesh import areas, counter_clockwise, mesh_of, stretch
from pyroshock.twin.plate.modes import (
    _rigid_modes,
    edge_layer_m,
    flexural_wavelength_m,
    kirchhoff_hz,
    mindlin_hz,
    solve_plate,
)
from pyroshock.twin.plate.outline import (
    Clamped,
    SimplySupported,
    area,
    canonical,
    checked_outline,
    with_corners,
)
from pyroshock.twin.setting import ElasticMaterial
from scipy.linalg import eigh
from skfem import MeshTri

STEEL = ElasticMaterial("steel", 200e9, 0.3, 7800.0)


def plate(thickness_m: float) -> PlateBuild:
    square = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))
    return PlateBuild(
        square,
        thickness_m,
        STEEL,
        named_points({"#1": (0.3, 0.3)}),
        named_points({"a": (0.6, 0.6)}),
    )


def flexural_hz(thickness_m: float, wavenumber_1_m: float) -> float:
    """The slower of Mindlin's two waves w, psi: their stiffness and inertia as 2 x 2 matrices."""
    h, k = thickness_m, wavenumber_1_m
    rigidity = 200e9 * h**3 / 12 / (1 - 0.3**2)
    shear = np.pi**2 / 12 * 200e9 / 2.6 * h
    stiffness = np.array([[shear * k**2, -shear * k], [-shear * k, rigidity * k**2 + shear]])
    inertia = np.diag([7800.0 * h, 7800.0 * h**3 / 12])
    return float(np.sqrt(eigh(stiffness, inertia, eigvals_only=True)[0]) / (2 * np.pi))


@pytest.mark.parametrize("waves_in_thickness", [0.02, 0.1, 0.5, 2.0])
def test_thick_plates_have_mindlins_waves(waves_in_thickness: float) -> None:
    h = 0.04
    build, k = plate(h), 2 * np.pi * waves_in_thickness / h
    thin_hz = k**2 * math.sqrt(200e9 * h**2 / 12 / (1 - 0.3**2) / 7800.0) / (2 * np.pi)
    thick_hz = flexural_hz(h, k)
    assert mindlin_hz(build, np.array([thin_hz, 0.0])) == pytest.approx([thick_hz, 0.0], rel=1e-9)
    assert kirchhoff_hz(build, thick_hz) == pytest.approx(thin_hz, rel=1e-9)
    assert flexural_wavelength_m(build, thin_hz) == pytest.approx(h / waves_in_thickness, rel=1e-12)
    assert edge_layer_m(build) == pytest.approx(h / np.pi, rel=1e-12)


def test_rayleighs_damping_has_both_ratios_and_both_laws_between() -> None:
    law = RayleighDamping(50.0, 0.02, 800.0, 0.05)
    assert law.ratios(np.array([0.0, 50.0, 800.0])) == pytest.approx([0.0, 0.02, 0.05], rel=1e-12)
    # 2 omega zeta = alpha + beta omega^2 is a straight line in the square of the frequency.
    frequency = np.array([0.1, 50.0, 200.0, 800.0, 3000.0])
    rate = 2 * frequency * law.ratios(frequency)
    line = np.polynomial.Polynomial.fit(frequency[[1, 3]] ** 2, rate[[1, 3]], 1)
    assert rate == pytest.approx(line(frequency**2), rel=1e-9)
    for none in (RayleighDamping(0.5, 0.0, 800.0, 0.0), ConstantDamping(0.0)):
        assert none.ratios(np.array([0.0, 3.0])).tolist() == [0, 0]
    for ratio in (-0.5, 1.0):
        with pytest.raises(ValueError, match=f"ratio = {ratio!r}: expected 0 to below 1"):
            ConstantDamping(ratio)


def test_damping_and_stretches_that_cannot_be_are_refused() -> None:
    none = "no Rayleigh damping"
    for given, words in (
        ((0.0, 0.02, 800.0, 0.05), "expected rising ones above 0"),
        ((800.0, 0.02, 800.0, 0.05), "expected rising ones above 0"),
        ((50.0, 0.07, 800.0, 1.0), r"ratios 0\.07 and 1\.0: no Rayleigh damping has them"),
        ((50.0, 0.1, 800.0, 1.5), none),
        ((50.0, 1.0, 800.0, 0.5), none),
        ((50.0, 0.02, 800.0, 0.001), none),
        ((50.0, 0.001, 800.0, 0.9), none),
    ):
        with pytest.raises(ValueError, match=words):
            RayleighDamping(*given)
    for start, stop in ((-0.1, 1.0), (0.0, 1.1), (0.5, 0.5), (0.7, 0.2)):
        for kind in (SimplySupported, Clamped):
            with pytest.raises(
                ValueError,
                match=f"stretch from {start!r} to {stop!r}: expected 0 <= start < stop <= 1",
            ):
                kind(0, start, stop)


def derivatives(terms: dict[tuple[int, int], float]) -> np.ndarray:
    """(w, w_x, w_y, w_xx, w_xy, w_yy) at 0 of a polynomial of second degree, by its powers of x and
    y."""
    powers = [(0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2)]
    return np.array([terms.get(each, 0.0) for each in powers]) * [1, 1, 1, 2, 1, 2]


@pytest.mark.parametrize("angle", [0.0, 0.4, np.pi / 4, np.pi / 2, 2.5])
def test_held_edges_leave_what_is_flat_along_them(angle: float) -> None:
    x, y = np.cos(angle), np.sin(angle)
    # With n the distance from the edge: n, n^2 and n t are 0 along it; of these n^2 has no slope
    # across it either.
    n = derivatives({(1, 0): -y, (0, 1): x})
    square = derivatives({(2, 0): y * y, (1, 1): -2 * x * y, (0, 2): x * x})
    mixed = derivatives({(2, 0): -x * y, (1, 1): x * x - y * y, (0, 2): x * y})
    along = np.array([x, y])
    for edge, left in ((SimplySupported(0), [n, square, mixed]), (Clamped(0), [square])):
        rows = edge.rows(along)
        np.testing.assert_allclose(rows @ np.transpose(left), 0.0, atol=1e-15)
        assert np.linalg.matrix_rank(rows, tol=1e-9) == 6 - len(left)


def test_points_of_sides_become_corners_and_of_stretches_and_triangles_are_found() -> None:
    ends = np.array([[1.0, 2.0], [4.0, 6.0]])
    along, across = np.array([3.0, 4.0]), np.array([-4.0, 3.0])
    shares = [-0.3, -1e-6, 0.0, 0.5, 1.0, 1 + 1e-6, 1.4]
    points = [ends[0] + share * along for share in shares] + [
        ends[0] + 0.5 * along + off * across for off in (1e-6, 1)
    ]
    assert on_stretch(np.transpose(points), ends) == [2, 3, 4]
    mesh = MeshTri().refined(1)
    places = np.array([[0.1, 0.2], [0.8, 0.9], [1.0, 1.0], [1 + 1e-8, 0.5]])
    local, where = _located(mesh, places)
    corners = mesh.p[:, mesh.t[:, where]]
    outline_corners = corners[:, 0] + sum(
        local[i, :, 0] * (corners[:, i + 1] - corners[:, 0]) for i in range(2)
    )
    np.testing.assert_allclose(outline_corners.T, places, atol=1e-12)
    with pytest.raises(ValueError, match="2 of 3 points lie off the plate"):
        _located(mesh, np.array([[1 + 1e-4, 0.5], [0.5, 0.5], [0.2, -0.3]]))
    corners = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]])
    outline_corners = with_corners(
        corners, np.array([[2.0, 0.5], [0.5, 0.0], [0.0, 1.0], [0.0, 0.25]])
    )
    expected = [[0, 0], [0.5, 0], [2, 0], [2, 0.5], [2, 1], [0, 1], [0, 0.25]]
    np.testing.assert_allclose(outline_corners, expected)
    # On a side in line with another one, which ends before.
    for start in range(8):
        turned = np.roll(np.array(BRIDGE), start, axis=0)
        for x, after in ((1.75, [1.5, 0.0]), (0.75, [0.0, 0.0])):
            more = with_corners(turned, np.array([[x, 0.0]])).tolist()
            assert more[more.index([x, 0.0]) - 1] == after


BRIDGE = (
    (0.0, 0.0),
    (1.0, 0.0),
    (1.0, 0.5),
    (1.5, 0.5),
    (1.5, 0.0),
    (3.0, 0.0),
    (3.0, 1.0),
    (0.0, 1.0),
)


@pytest.mark.parametrize(
    ("outline", "message"),
    [
        (
            ((0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (1.5, 0.0), (1.0, 1.0)),
            "sides at corner 2 fold back",
        ),
        (((0.0, 0.0), (1.0, 0.0), (math.nan, 1.0)), "expected three corners"),
        (((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)), "expected three corners"),
        (
            ((0.0, 0.0), (1.0, 0.0), (1.0, 0.5), (0.5, 0.0), (0.0, 0.5)),
            "sides 0 and 2 touch or cross",
        ),
        (
            ((0.0, 0.0), (1.0, 0.0), (2.0, 0.5), (1.0, 1.0), (1.0, -1.0)),
            "sides 0 and 3 touch or cross",
        ),
        (
            ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 0.0), (-1.0, 1.0), (-1.0, 0.0)),
            "sides 0 and 2 touch or cross",
        ),
    ],
)
def test_outlines_that_are_no_polygon_are_refused(
    outline: tuple[tuple[float, float], ...], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        checked_outline(outline)
    for in_line in (BRIDGE, ((0.0, 0.0), (0.5, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))):
        for corner_order in (in_line, in_line[::-1]):
            checked_outline(corner_order)


def test_outlines_are_the_same_from_any_corner_and_cross_from_any() -> None:
    """Its area is signed; triangles turn counter-clockwise."""
    corners = np.array([[0.0, 0.2], [1.0, 0.0], [1.2, 0.9], [0.0, 0.7]])
    for start in range(4):
        turned = np.roll(corners, start, axis=0)
        np.testing.assert_array_equal(canonical(turned), corners)
        np.testing.assert_array_equal(canonical(turned[::-1]), corners)
    shoelace = sum(
        np.linalg.det(np.stack([a, b]))
        for a, b in zip(corners, np.roll(corners, -1, 0), strict=True)
    )
    assert area(corners) == -area(corners[::-1]) == pytest.approx(0.5 * abs(shoelace))
    points, triangles = (
        np.array([[0.0, 0.0], [2.0, 0.0], [0.0, 3.0]]),
        np.array([[0, 1, 2], [0, 2, 1]]),
    )
    assert areas(points, triangles).tolist() == [3.0, -3.0]
    assert areas(points, counter_clockwise(points, triangles)).tolist() == [3.0, 3.0]
    bow = np.array([[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]])
    for start in range(4):
        for direction in (1, -1):
            with pytest.raises(ValueError, match="touch or cross"):
                checked_outline(
                    tuple(map(tuple, np.roll(bow, start, axis=0)[::direction].tolist()))
                )


def test_a_plate_knows_its_mass_and_its_rigidity_and_where_a_stretch_lies() -> None:
    build = replace(plate(0.02), outline_m=((0.0, 0.0), (0.0, 2.0), (1.0, 0.0)))
    assert build.area_m2 == pytest.approx(1.0)
    assert build.mass_per_area_kg_m2 == pytest.approx(156.0)
    assert build.mass_kg == pytest.approx(156.0)
    assert build.rigidity_n_m == pytest.approx(200e9 * 8e-6 / 12 / 0.91, rel=1e-12)
    outline = ((0.0, 0.0), (1.0, 0.0), (1.0, 2.0), (0.0, 1.0))
    stretches = [
        stretch(replace(plate(0.01), outline_m=outline), Clamped(side, 0.25, 0.5)).tolist()
        for side in range(4)
    ]
    expected = [
        [[0.25, 0], [0.5, 0]],
        [[1, 0.5], [1, 1]],
        [[0.75, 1.75], [0.5, 1.5]],
        [[0, 0.75], [0, 0.5]],
    ]
    assert stretches == expected


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"sensors": ()}, r"sensors has names \[\]: expected one or more, each of them once"),
        (
            {"impact_points": (NamedPoint("#1", (0.1, 0.1)), NamedPoint("#1", (0.2, 0.1)))},
            r"impact_points has names \['#1', '#1'\]",
        ),
        ({"edges": (Clamped(4),)}, "edge 4: expected 0 to 3"),
        ({"edges": (Clamped(-1),)}, "edge -1: expected 0 to 3"),
        ({"thickness_m": 0.0}, r"thickness_m = 0\.0: expected a positive number"),
        ({"thickness_m": math.inf}, "thickness_m = inf"),
        ({"masses": (PointMass((0.1, 0.1), -0.5),)}, r"mass_kg = -0\.5: expected 0 or more"),
        (
            {"springs": (PointSpring((0.1, 0.1), math.inf),)},
            "stiffness_n_m = inf: expected 0 or more",
        ),
    ],
)
def test_plates_that_cannot_be_are_refused(change: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        replace(plate(0.01), **change)
    assert (
        replace(plate(0.01), masses=(PointMass((0.1, 0.1), 0.0),), edges=(Clamped(3),))
        .edges[0]
        .side
        == 3
    )


def test_a_mesh_is_fine_about_what_is_sharp_and_nowhere_else() -> None:
    """A corner that turns in, at (0.5, 0.4), and the ends of a clamp."""
    ell = ((0.0, 0.0), (1.0, 0.0), (1.0, 0.4), (0.5, 0.4), (0.5, 0.8), (0.0, 0.8))
    for outline in (ell, ell[::-1]):
        build = replace(plate(0.01), outline_m=outline, sensors=named_points({"a": (0.2, 0.2)}))
        mesh = mesh_of(build, 0.2)
        corners = mesh.p[:, mesh.t]
        size = np.max(
            [np.linalg.norm(corners[:, i] - corners[:, i - 1], axis=0) for i in range(3)], axis=0
        )
        distance = np.linalg.norm(corners.mean(axis=1).T - [0.5, 0.4], axis=1)
        assert np.all(size <= np.clip(0.5 * distance, 0.2 / 16, 0.2) + 1e-12)
        assert size.min() < 0.2 / 16 < 0.05 < size[distance > 0.4].min()
        (x0, x1), (y0, y1) = corners[:, 1:] - corners[:, :1]
        assert np.abs(x0 * y1 - x1 * y0).sum() / 2 == pytest.approx(build.area_m2, rel=1e-12)
    assert mesh_of(plate(0.01), 0.6).t.shape[1] < 40
    held = mesh_of(replace(plate(0.01), edges=(Clamped(0, 0.25, 0.5),)), 0.6)
    for end in (0.25, 0.5):
        assert np.min(np.linalg.norm(held.p.T - [end, 0.0], axis=1)) < 1e-12


@pytest.mark.parametrize("layer_m", [0.0, 0.004])
def test_a_plate_resists_twisting_but_in_the_layer_along_its_free_edges(layer_m: float) -> None:
    """w = x y: of bending energy D (1 - nu) w_xy^2 is left over the area less the layer's."""
    length = 0.5
    elements = elements_of(plate(0.01), length, layer_m)
    basis = elements.basis
    for twisted, turned in (
        (lambda x: x[0] * x[1], 1.0),
        (lambda x: (x[0] ** 2 - x[1] ** 2) / 2, 0.0),
    ):
        unknowns = basis.project(twisted)
        energy = unknowns @ elements.stiffness @ unknowns
        resisting = 1.0 - turned * 4 * layer_m  # m2 of the unit square
        expected = 2 * (1 - 0.3) * plate(0.01).rigidity_n_m / length**4 * resisting
        assert energy == pytest.approx(expected, rel=1e-6)


def test_mixed_derivative_across_and_along_an_edge() -> None:
    second, angle = np.array([[2.0, 0.7], [0.7, -3.0]]), 0.6
    normal, along = (
        np.array([np.cos(angle), np.sin(angle)]),
        np.array([-np.sin(angle), np.cos(angle)]),
    )
    assert _across_along(second, normal) == pytest.approx(normal @ second @ along, rel=1e-12)


@pytest.mark.parametrize("turned", [0.0, np.pi / 4, 1.0])
def test_what_is_not_held_moves_as_a_whole(turned: float) -> None:
    c, s = np.cos(turned), np.sin(turned)
    square = tuple((c * x - s * y, s * x + c * y) for x, y in plate(0.01).outline_m)
    build = replace(plate(0.01), outline_m=square)
    ways = {
        (): 3,
        (SimplySupported(0),): 1,
        (Clamped(0),): 0,
        (SimplySupported(0), SimplySupported(1, 0.5, 0.6)): 0,
    }
    assert {edges: _rigid_modes(replace(build, edges=edges)) for edges in ways} == ways
    spring = PointSpring((0.3 * c - 0.3 * s, 0.3 * s + 0.3 * c), 1e3)
    assert _rigid_modes(replace(build, springs=(spring,))) == 2
    assert _rigid_modes(replace(build, springs=(replace(spring, stiffness_n_m=0.0),))) == 3


@pytest.mark.parametrize("turned", [0.0, 0.5])
def test_a_square_that_is_clamped_all_around(turned: float) -> None:
    """35.985 by Ritz (Leissa, NASA SP-160, has 35.992): omega a^2 sqrt(rho h / D)."""
    c, s = np.cos(turned), np.sin(turned)
    square = tuple((c * x - s * y, s * x + c * y) for x, y in plate(0.005).outline_m)
    middle = named_points({"a": ((c - s) / 2, (s + c) / 2)})
    build = replace(
        plate(0.005),
        outline_m=square,
        impact_points=middle,
        sensors=middle,
        edges=tuple(Clamped(side) for side in range(4)),
    )
    unit = np.sqrt(build.rigidity_n_m / build.mass_per_area_kg_m2) / (2 * np.pi)
    found = solve_plate(build, 40 * unit, thickness_correction=False).frequency_hz / unit
    assert found == pytest.approx([35.985], rel=1e-4)
