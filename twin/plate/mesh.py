"""The mesh of a plate: triangles no larger than a part of a wavelength, finer where the solution is sharp."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...array_types import Floats
from .build import PlateBuild
from .edges import Edge
from .outline import canonical, with_corners
from .triangles import counter_clockwise, ears, flipped, smoothed

_SMOOTHINGS = 5
#: Sides of triangles near a sharp point, as a part of their distance from it.
_GRADING = 0.5
#: How much finer than elsewhere the mesh becomes at a sharp point.
_FINEST = 1 / 16


def mesh_of(build: PlateBuild, length_m: float) -> Any:
    """A `skfem.MeshTri` with sides up to about `length_m`, and a corner at every end of a held stretch.

    The same for a polygon that is given from another corner or the other way round. Sharp points are the ends of held
    stretches and corners that turn in: moments go to infinity there, and the order of convergence would be lost.
    """
    from skfem import MeshTri

    sides = np.array(build.outline_m, dtype=np.float64)
    ends = np.array([point for edge in build.edges for point in stretch(build, edge)]).reshape(-1, 2)
    corners = with_corners(canonical(sides), ends)
    mesh = MeshTri(np.ascontiguousarray(corners.T), np.ascontiguousarray(flipped(corners, ears(corners)).T))
    sharp = np.concatenate([ends, _turning_in(canonical(sides))])
    while np.any(large := _longest(mesh) > _wanted(mesh, sharp, length_m)):
        mesh = mesh.refined(np.flatnonzero(large))
        mesh = _improved(mesh)
    return mesh


def stretch(build: PlateBuild, edge: Edge) -> Floats:
    """Both ends (2, 2) of a held stretch."""
    corners = np.array(build.outline_m, dtype=np.float64)
    begin, end = corners[edge.side], corners[(edge.side + 1) % len(corners)]
    return np.array([begin + edge.start * (end - begin), begin + edge.stop * (end - begin)])


def _improved(mesh: Any) -> Any:
    """The same points joined better, and the inner ones moved to the middle of their neighbours."""
    from skfem import MeshTri

    held = np.zeros(mesh.p.shape[1], dtype=bool)
    held[mesh.boundary_nodes()] = True
    points, triangles = mesh.p.T, counter_clockwise(mesh.p.T, mesh.t.T)
    for _ in range(_SMOOTHINGS):
        triangles = flipped(points, triangles)
        points = smoothed(points, triangles, held)
    return MeshTri(np.ascontiguousarray(points.T), np.ascontiguousarray(triangles.T))


def _longest(mesh: Any) -> Floats:
    """The longest side of each triangle."""
    a, b, c = mesh.p[:, mesh.t].swapaxes(0, 1)
    return np.asarray(np.max([np.linalg.norm(x - y, axis=0) for x, y in ((a, b), (b, c), (c, a))], axis=0))


def _wanted(mesh: Any, sharp: Floats, length_m: float) -> Floats:
    """The longest side that is wanted of each triangle."""
    middle = mesh.p[:, mesh.t].mean(axis=1).T
    if not len(sharp):
        return np.full(len(middle), length_m)
    distance = np.min(np.linalg.norm(middle[:, None] - sharp, axis=2), axis=1)
    return np.asarray(np.clip(_GRADING * distance, _FINEST * length_m, length_m))


def _turning_in(corners: Floats) -> Floats:
    """Corners (k, 2) of more than 180 degrees, of a polygon that goes counter-clockwise."""
    (ax, ay), (bx, by) = (corners - np.roll(corners, 1, axis=0)).T, (np.roll(corners, -1, axis=0) - corners).T
    return np.asarray(corners[ax * by - ay * bx < 0])
