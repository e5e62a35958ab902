"""The mesh of a quadrilateral: where points, edges and the ends of clamps lie."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pyroshock.virtualbench.plate.build import OUTLINE_M, Clamp
from pyroshock.virtualbench.plate.mesh import Mesh, bilinear

MESH = Mesh.regular(OUTLINE_M, 4, 3, 3)


@settings(max_examples=100)
@given(st.floats(0, 1), st.floats(0, 1))
def test_a_point_is_found_again(u: float, v: float) -> None:
    point = bilinear(MESH.corners_m, np.array([u]), np.array([v]))[0][0]
    assert MESH.locate((point[0], point[1])) == pytest.approx((u, v), abs=1e-9)


@pytest.mark.parametrize("point", [(0.0, 0.0), (0.9, 0.6), (-0.01, 0.1), (5.0, 5.0)])
def test_a_point_off_the_plate_is_refused(point: tuple[float, float]) -> None:
    with pytest.raises(ValueError, match="off the plate"):
        MESH.locate(point)


def test_neighbours_share_the_nodes_between_them() -> None:
    unknowns = MESH.element_unknowns()
    assert unknowns.shape == (12, 48)
    assert np.unique(unknowns).size == MESH.size == 3 * 13 * 10
    assert np.intersect1d(unknowns[0], unknowns[1]).size == 3 * 4


@pytest.mark.parametrize("edge", range(4))
def test_elements_end_where_a_clamp_does(edge: int) -> None:
    clamp = Clamp(edge, 0.3, 0.71)
    mesh = Mesh.regular(OUTLINE_M, 4, 3, 3, (clamp,))
    ends = {0.3, 0.71} if edge < 2 else {0.7, 0.29}
    lines = mesh.v if edge % 2 else mesh.u
    assert all(np.abs(lines - end).min() < 1e-12 for end in ends)
    assert np.diff(lines).max() <= 1 / (3 if edge % 2 else 4) + 1e-12


@pytest.mark.parametrize(("edge", "corners"), [(0, (0, 1)), (1, (1, 2)), (2, (2, 3)), (3, (3, 0))])
def test_an_edge_runs_from_its_corner_to_the_next(edge: int, corners: tuple[int, int]) -> None:
    at_corners = [MESH.deflection_at(OUTLINE_M[k]) for k in corners]
    first, last = (unknowns[np.argmax(weights)] // 3 for unknowns, weights in at_corners)
    assert first in MESH.edge_nodes(Clamp(edge, 0.0, 0.1))
    assert last in MESH.edge_nodes(Clamp(edge, 0.9, 1.0))
    assert last not in MESH.edge_nodes(Clamp(edge, 0.0, 0.9))
