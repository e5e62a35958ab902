"""The spectral element and its mesh: nodes, polynomials, states of strain, and where points and
clamps lie."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pyroshock.virtualbench.plate.build import OUTLINE_M, Clamp, PlateMaterial
from pyroshock.virtualbench.plate.mesh import Mesh, basis, bilinear, lobatto_nodes
from pyroshock.virtualbench.plate.modes import assemble, deflection_rows

STEEL = PlateMaterial(200e9, 0.30, 7800.0)
THICKNESS_M = 0.01
AREA_M2 = 0.3448


@pytest.mark.parametrize("degree", [1, 2, 6, 9])
def test_polynomials_up_to_the_degree_are_exact(degree: int) -> None:
    inner = math.sqrt(3 / 7)
    assert lobatto_nodes(4) == pytest.approx([-1, -inner, 0, inner, 1])
    x = np.linspace(-1, 1, 17)
    values, slopes = basis(degree, x)
    for power in range(degree + 1):
        at_nodes = lobatto_nodes(degree) ** power
        assert values @ at_nodes == pytest.approx(x**power, abs=1e-12)
        assert slopes @ at_nodes == pytest.approx(power * x ** max(power - 1, 0), abs=1e-10)


@pytest.fixture(scope="module")
def plate() -> tuple[Mesh, np.ndarray, np.ndarray, np.ndarray]:
    """Mesh, stiffness, mass and node positions (nodes, 2) of the irregular plate, a few elements
    large."""
    mesh = Mesh.regular(OUTLINE_M, 3, 2, 4)
    stiffness, mass = assemble(mesh, STEEL, THICKNESS_M)
    return mesh, stiffness.toarray(), mass.toarray(), _positions(mesh)


def _positions(mesh: Mesh) -> np.ndarray:
    nodes = (lobatto_nodes(mesh.degree)[:-1] + 1) / 2
    u, v = (
        np.append((lines[:-1, None] + np.diff(lines)[:, None] * nodes).ravel(), 1.0)[:, None]
        for lines in (mesh.u, mesh.v)
    )
    a, b, c, d = mesh.corners_m
    grid_u, grid_v = np.repeat(u, v.size, axis=0), np.tile(v, (u.size, 1))
    return (
        a * (1 - grid_u) * (1 - grid_v)
        + b * grid_u * (1 - grid_v)
        + c * grid_u * grid_v
        + d * (1 - grid_u) * grid_v
    )


def _state(
    deflection: np.ndarray, turn_x: np.ndarray | float, turn_y: np.ndarray | float
) -> np.ndarray:
    return np.stack(np.broadcast_arrays(deflection, turn_x, turn_y), axis=-1).ravel()


def test_strains_deflections_and_moves_of_the_whole_are_exact(
    plate: tuple[Mesh, np.ndarray, np.ndarray, np.ndarray],
) -> None:
    _, stiffness, mass, positions = plate
    up = _state(np.ones(len(positions)), 0.0, 0.0)
    assert up @ mass @ up == pytest.approx(7800 * THICKNESS_M * AREA_M2, rel=1e-12)
    assert np.abs(stiffness @ up).max() < 1e-9 * np.abs(stiffness).max()
    _, stiffness, _, positions = plate
    x, y = positions.T
    assert (
        np.abs(stiffness @ _state(2 * x - 3 * y, -2.0, 3.0)).max() < 1e-9 * np.abs(stiffness).max()
    )
    kx, ky = 0.3, -0.7
    bent = _state(-(kx * x**2 + ky * y**2) / 2, kx * x, ky * y)
    rigidity = 200e9 * THICKNESS_M**3 / (12 * (1 - 0.3**2))
    expected = rigidity * (kx**2 + ky**2 + 2 * 0.3 * kx * ky) * AREA_M2
    assert bent @ stiffness @ bent == pytest.approx(expected, rel=1e-9)
    sheared = _state(positions[:, 0], 0.0, 0.0)
    modulus = 200e9 / 2.6
    assert sheared @ stiffness @ sheared == pytest.approx(
        5 / 6 * modulus * THICKNESS_M * AREA_M2, rel=1e-9
    )
    mesh, _, _, positions = plate
    x, y = positions.T
    points = [(0.47, 0.28), (0.9, 0.37), (0.0, 0.10)]
    read = deflection_rows(mesh, points) @ _state(1 + x * y - y**2, 0.0, 0.0)
    assert read == pytest.approx([1 + x * y - y**2 for x, y in points], rel=1e-12)


MESH = Mesh.regular(OUTLINE_M, 4, 3, 3)


@settings(max_examples=100)
@given(st.floats(0, 1), st.floats(0, 1))
def test_a_point_is_found_again(u: float, v: float) -> None:
    point = bilinear(MESH.corners_m, np.array([u]), np.array([v]))[0][0]
    assert MESH.locate((point[0], point[1])) == pytest.approx((u, v), abs=1e-9)


def test_neighbours_share_the_nodes_between_them_and_points_off_the_plate_are_refused() -> None:
    unknowns = MESH.element_unknowns()
    assert unknowns.shape == (12, 48)
    assert np.unique(unknowns).size == MESH.size == 3 * 13 * 10
    assert np.intersect1d(unknowns[0], unknowns[1]).size == 3 * 4
    for point in ((0.0, 0.0), (0.9, 0.6), (-0.01, 0.1), (5.0, 5.0)):
        with pytest.raises(ValueError, match="off the plate"):
            MESH.locate(point)


@pytest.mark.parametrize("edge", range(4))
def test_an_edge_runs_from_its_corner_to_the_next_and_elements_end_where_a_clamp_does(
    edge: int,
) -> None:
    mesh = Mesh.regular(OUTLINE_M, 4, 3, 3, (Clamp(edge, 0.3, 0.71),))
    lines = mesh.v if edge % 2 else mesh.u
    for end in (0.3, 0.71) if edge < 2 else (0.7, 0.29):
        assert np.abs(lines - end).min() < 1e-12
    assert np.diff(lines).max() <= 1 / (3 if edge % 2 else 4) + 1e-12
    at_corners = [MESH.deflection_at(OUTLINE_M[k % 4]) for k in (edge, edge + 1)]
    first, last = (unknowns[np.argmax(weights)] // 3 for unknowns, weights in at_corners)
    assert first in MESH.edge_nodes(Clamp(edge, 0.0, 0.1))
    assert last in MESH.edge_nodes(Clamp(edge, 0.9, 1.0))
    assert last not in MESH.edge_nodes(Clamp(edge, 0.0, 0.9))
