"""The mesh of a plate: triangles no larger than a part of a wavelength, finer where the solution is
sharp.

Triangles for a simple polygon: fat ears, Delaunay flips, smoothing. Corners are points (p, 2),
triangles (t, 3).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from .build import PlateBuild
from .outline import Edge, canonical, with_corners

Indices = NDArray[np.intp]


def ears(corners: Floats) -> Indices:
    """The polygon (counter-clockwise) cut into triangles between its corners, fattest ear first.

    Ear clipping (Meisters, Am. Math. Monthly 82, 1975); any simple polygon has an ear.
    """
    remaining = list(range(len(corners)))
    cut = []
    while len(remaining) > 3:
        triples = [
            (remaining[i - 1], remaining[i], remaining[(i + 1) % len(remaining)])
            for i in range(len(remaining))
        ]
        fatness = [_ear_fatness(corners, triple, remaining) for triple in triples]
        best = int(np.argmax(fatness))
        if fatness[best] <= 0:
            raise ValueError("the outline has no ear: expected a simple polygon, counter-clockwise")
        cut.append(triples[best])
        remaining.pop(best)
    return np.array([*cut, tuple(remaining)], dtype=np.intp)


def flipped(points: Floats, triangles: Indices) -> Indices:
    """The same with sides flipped until every inner one is locally Delaunay (Lawson 1977); the
    outline stays."""
    triangles = triangles.copy()
    sides = _sides(triangles)
    waiting = [side for side, two in sides.items() if len(two) == 2]
    while waiting:
        side = waiting.pop()
        two = sides.get(side, [])
        if len(two) == 2 and (around := _flip(points, triangles, sides, side, two)):
            waiting.extend(other for other in around if len(sides[other]) == 2)
    return triangles


def smoothed(points: Floats, triangles: Indices, held: NDArray[np.bool_]) -> Floats:
    """Points that are not held moved to the middle of their neighbours, unless that thins a
    triangle.

    Triangles go counter-clockwise.
    """
    corner, next_corner = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    total, count = np.zeros_like(points), np.zeros(len(points))
    for here, there in ((corner, next_corner), (next_corner, corner)):
        np.add.at(total, here, points[there])
        np.add.at(count, here, 1)
    moved = np.where(held[:, None], points, total / count[:, None])
    before = areas(points, triangles)
    while np.any(bad := areas(moved, triangles) < 0.3 * before):
        back = np.unique(triangles[bad])
        moved[back] = points[back]
    return moved


def counter_clockwise(points: Floats, triangles: Indices) -> Indices:
    """The same triangles, each turned if need be."""
    return np.where((areas(points, triangles) < 0)[:, None], triangles[:, ::-1], triangles)


def areas(points: Floats, triangles: Indices) -> Floats:
    """Of each triangle; negative where it goes clockwise."""
    a, b, c = (points[triangles[:, k]] for k in range(3))
    (ux, uy), (vx, vy) = (b - a).T, (c - a).T
    return np.asarray((ux * vy - uy * vx) / 2)


def _ear_fatness(corners: Floats, triple: tuple[int, int, int], remaining: list[int]) -> float:
    """4 sqrt(3) area over the sum of squared sides: 1 for an equilateral triangle; -1 for what is
    no ear."""
    size = areas(corners, np.array([triple]))[0]
    a, b, c = corners[list(triple)]
    squares = float(np.sum((a - b) ** 2) + np.sum((b - c) ** 2) + np.sum((c - a) ** 2))
    others = np.array([i for i in remaining if i not in triple])
    sides = zip(triple, (*triple[1:], triple[0]), strict=True)
    parts = [areas(corners, np.array([[i, j, k] for k in others])) for i, j in sides]
    if size <= 1e-12 * squares or np.any(np.min(parts, axis=0) >= -1e-12 * squares):
        return -1.0
    return float(4 * np.sqrt(3) * size / squares)


def _sides(triangles: Indices) -> dict[tuple[int, int], list[int]]:
    """The triangles at each side."""
    triangles_by_side: dict[tuple[int, int], list[int]] = {}
    for number, (a, b, c) in enumerate(triangles.tolist()):
        for side in ((a, b), (b, c), (c, a)):
            triangles_by_side.setdefault(_key(*side), []).append(number)
    return triangles_by_side


def _key(a: int, b: int) -> tuple[int, int]:
    return (a, b) if a < b else (b, a)


def _flip(
    points: Floats,
    triangles: Indices,
    sides: dict[tuple[int, int], list[int]],
    side: tuple[int, int],
    two: list[int],
) -> list[tuple[int, int]]:
    """Flips a side that is not Delaunay, and tells the four sides around; none where it stays."""
    first, second = two
    a, b = side
    c = _opposite(triangles[first], side)
    d = _opposite(triangles[second], side)
    if _cotangent(points, c, a, b) + _cotangent(points, d, a, b) >= -1e-9:
        return []
    if areas(points, np.array([(c, a, d)]))[0] < 0:
        a, b = b, a
    new = np.array([(c, a, d), (d, b, c)])
    if np.any(areas(points, new) <= 0):
        return []
    triangles[first], triangles[second] = new
    del sides[side]
    sides[_key(c, d)] = [first, second]
    sides[_key(a, d)] = [first if t == second else t for t in sides[_key(a, d)]]
    sides[_key(b, c)] = [second if t == first else t for t in sides[_key(b, c)]]
    return [_key(a, c), _key(a, d), _key(b, c), _key(b, d)]


def _opposite(triangle: Indices, side: tuple[int, int]) -> int:
    return next(int(corner) for corner in triangle.tolist() if corner not in side)


def _cotangent(points: Floats, at: int, corner: int, other: int) -> float:
    """Of the angle at a corner; two opposite angles of more than pi together have a negative sum of
    these."""
    (ux, uy), (vx, vy) = (
        (points[corner] - points[at]).tolist(),
        (points[other] - points[at]).tolist(),
    )
    return float((ux * vx + uy * vy) / max(abs(ux * vy - uy * vx), 1e-300))


_SMOOTHINGS = 5
#: Sides of triangles near a sharp point, as a part of their distance from it.
_GRADING = 0.5
#: How much finer than elsewhere the mesh becomes at a sharp point.
_FINEST = 1 / 16


def mesh_of(build: PlateBuild, length_m: float) -> Any:
    """A `skfem.MeshTri` with sides up to about `length_m`, and a corner at every end of a held
    stretch.

    The same for a polygon that is given from another corner or the other way round. Sharp points
    are the ends of held stretches and corners that turn in: moments go to infinity there, and the
    order of convergence would be lost.
    """
    from skfem import MeshTri

    sides = np.array(build.outline_m, dtype=np.float64)
    ends = np.array([point for edge in build.edges for point in stretch(build, edge)]).reshape(
        -1, 2
    )
    corners = with_corners(canonical(sides), ends)
    mesh = MeshTri(
        np.ascontiguousarray(corners.T), np.ascontiguousarray(flipped(corners, ears(corners)).T)
    )
    sharp = np.concatenate([ends, _turning_in(canonical(sides))])
    while np.any(large := _longest(mesh) > _target_side(mesh, sharp, length_m)):
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
    return np.asarray(
        np.max([np.linalg.norm(x - y, axis=0) for x, y in ((a, b), (b, c), (c, a))], axis=0)
    )


def _target_side(mesh: Any, sharp: Floats, length_m: float) -> Floats:
    """The longest side that is wanted of each triangle."""
    middle = mesh.p[:, mesh.t].mean(axis=1).T
    if not len(sharp):
        return np.full(len(middle), length_m)
    distance = np.min(np.linalg.norm(middle[:, None] - sharp, axis=2), axis=1)
    return np.asarray(np.clip(_GRADING * distance, _FINEST * length_m, length_m))


def _turning_in(corners: Floats) -> Floats:
    """Corners (k, 2) of more than 180 degrees, of a polygon that goes counter-clockwise."""
    (ax, ay), (bx, by) = (
        (corners - np.roll(corners, 1, axis=0)).T,
        (np.roll(corners, -1, axis=0) - corners).T,
    )
    return np.asarray(corners[ax * by - ay * bx < 0])
