"""Kirchhoff's plate by Argyris' triangle: stiffness, mass, and what rows of it are held.

Argyris, Fried and Scharpf (Aeronaut. J. 72, 1968): complete polynomials of degree five with
continuous slopes, as Kirchhoff's plate needs them. Frequencies converge with the eighth power of
the mesh size.

Where points lie in the mesh: its frame, its triangles, and deflections there.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...array_types import Floats
from .build import PlateBuild
from .mesh import mesh_of, stretch
from .outline import Point


@dataclass(frozen=True, eq=False)
class PlateFrame:
    """Lengths in `unit_m`, from the middle of the plate.

    The unknowns are then all of the size of the deflections, and the powers of x and y, which the
    element is made of, stay small.
    """

    origin_m: Floats
    unit_m: float

    def local(self, points_m: Floats) -> Floats:
        """Points (n, 2) in this frame."""
        return (points_m - self.origin_m) / self.unit_m


def deflections(basis: Any, points: Floats) -> Floats:
    """As `Elements.rows`, for points (n, 2) in the units of the mesh."""
    out = np.zeros((len(points), basis.N))
    if not len(points):
        return out
    at, where = _located(basis.mesh, points)
    for i in range(basis.Nbfun):
        out[np.arange(len(points)), basis.element_dofs[i, where]] = basis.elem.gbasis(
            basis.mapping, at, i, where
        )[0][:, 0]
    return out


def _located(mesh: Any, points: Floats) -> tuple[Floats, Any]:
    """Coordinates (2, n, 1) of points (n, 2) within their triangles, and the triangles."""
    corners = mesh.p[:, mesh.t]  # (2, 3, triangles)
    edges = np.stack([corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]], axis=1)
    local = np.einsum(
        "tij,jnt->int",
        np.linalg.inv(edges.transpose(2, 0, 1)),
        points.T[:, :, None] - corners[:, None, 0],
    )
    inside = np.minimum(local.min(axis=0), 1 - local.sum(axis=0))
    where = np.argmax(inside, axis=1)
    rows = np.arange(len(points))
    if np.any(off := inside[rows, where] < -1e-6):
        raise ValueError(f"{off.sum()} of {off.size} points lie off the plate")
    return local[:, rows, where, None], where


_NODAL = 6


def free_unknowns(build: PlateBuild, basis: Any, frame: PlateFrame) -> Any:
    """Columns span what the held edges leave, corner by corner of the mesh; orthonormal there."""
    from scipy.sparse import coo_matrix

    rules, fixed = _constraints(build, basis, frame)
    columns: list[tuple[int, int, float]] = []
    count = 0
    for node, dofs in enumerate(basis.nodal_dofs.T):
        null_space = _null_space(np.concatenate(rules[node])) if node in rules else np.eye(_NODAL)
        columns += [
            (dofs[i], count + j, null_space[i, j])
            for i in range(_NODAL)
            for j in range(null_space.shape[1])
            if null_space[i, j]
        ]
        count += null_space.shape[1]
    for dof in basis.facet_dofs.ravel():
        if dof not in fixed:
            columns.append((dof, count, 1.0))
            count += 1
    rows, cols, values = zip(*columns, strict=True)
    return coo_matrix(
        (np.array(values), (np.array(rows), np.array(cols))), shape=(basis.N, count)
    ).tocsc()


def _constraints(
    build: PlateBuild, basis: Any, frame: PlateFrame
) -> tuple[dict[int, list[Floats]], set[int]]:
    """What is zero at corners of the mesh, by corner, and the slopes across sides that are."""
    rules: dict[int, list[Floats]] = defaultdict(list)
    fixed: set[int] = set()
    for edge in build.edges:
        ends = frame.local(stretch(build, edge))
        along = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
        for node in on_stretch(basis.mesh.p, ends):
            rules[node].append(edge.rows(along))
        if edge.holds_slope:
            fixed.update(basis.facet_dofs[0, on_stretch(middles(basis.mesh), ends)].tolist())
    return rules, fixed


def on_stretch(points: Floats, ends: Floats) -> list[int]:
    """Which of points (2, n) lie on the stretch between two ends (2, 2)."""
    along = ends[1] - ends[0]
    share = (points.T - ends[0]) @ along / (along @ along)
    off = np.linalg.norm(points.T - ends[0] - share[:, None] * along, axis=1)
    near = 1e-9 * np.linalg.norm(along)
    return np.flatnonzero((off < near) & (share > -1e-9) & (share < 1 + 1e-9)).tolist()


def _null_space(rows: Floats) -> Floats:
    from scipy.linalg import null_space

    return np.asarray(null_space(rows, rcond=1e-9))


def middles(mesh: Any) -> Floats:
    """Of all sides, (2, sides)."""
    return np.asarray(mesh.p[:, mesh.facets].mean(axis=1))


_ORDER = 10  # of quadrature: products of two quintics


@dataclass(frozen=True, eq=False)
class Elements:
    """Sparse matrices over all unknowns (u), and `free` (u, v): unknowns from those that nothing
    holds.

    `frame` is that of the mesh.
    """

    basis: Any
    stiffness: Any
    mass: Any
    free: Any
    frame: PlateFrame

    def rows(self, points: Sequence[Point]) -> Floats:
        """Deflection at points from the unknowns, (points, u). Raises `ValueError` for a point off
        the plate."""
        return deflections(
            self.basis, self.frame.local(np.array(points, dtype=np.float64).reshape(-1, 2))
        )


def elements_of(build: PlateBuild, length_m: float, edge_layer_m: float = 0.0) -> Elements:
    """Of the plate with its masses, springs and held edges, by triangles with sides up to
    `length_m`.

    A layer of `edge_layer_m` along free edges does not resist twisting (`thickness.edge_layer_m`).
    """
    from scipy.sparse import csc_matrix
    from skfem import Basis, ElementTriArgyris

    frame = PlateFrame(np.array(build.outline_m, dtype=np.float64).mean(axis=0), length_m)
    mesh = mesh_of(build, length_m).translated(tuple(-frame.origin_m)).scaled(1 / length_m)
    # Argyris' element keeps the inverse of its last mesh: never share one.
    basis = Basis(mesh, ElementTriArgyris(), intorder=_ORDER)
    bending, inertia = _forms(build.material.poisson_ratio)
    layer = edge_layer_m / length_m * _edge_twist(build, mesh, frame)
    stiffness = build.rigidity_n_m / length_m**2 * (bending.assemble(basis) - layer)
    mass = build.mass_per_area_kg_m2 * length_m**2 * inertia.assemble(basis)
    bare = Elements(basis, stiffness, mass, None, frame)
    springs = csc_matrix(bare.rows([spring.position_m for spring in build.springs]))
    bolted = csc_matrix(bare.rows([point_mass.position_m for point_mass in build.masses]))
    held = np.array([spring.stiffness_n_m for spring in build.springs])
    added = np.array([point_mass.mass_kg for point_mass in build.masses])
    stiffness = (stiffness + springs.T @ springs.multiply(held[:, None])).tocsc()
    mass = (mass + bolted.T @ bolted.multiply(added[:, None])).tocsc()
    return Elements(basis, stiffness, mass, free_unknowns(build, basis, frame), frame)


def _forms(nu: float) -> tuple[Any, Any]:
    """Bending energy for D = 1, and inertia for rho h = 1."""
    from skfem import BilinearForm
    from skfem.helpers import dd, ddot, trace

    def bending(u: Any, v: Any, _: Any) -> Any:
        a, b = dd(u), dd(v)
        return (1 - nu) * ddot(a, b) + nu * trace(a) * trace(b)

    return BilinearForm(bending), BilinearForm(lambda u, v, _: u * v)


def _edge_twist(build: PlateBuild, mesh: Any, frame: PlateFrame) -> Any:
    """Twisting energy along the free edges for D = 1, per depth of edge.

    Sides shorter than two thicknesses, about sharp points, have none: there is no room for a layer.
    """
    from skfem import BilinearForm, ElementTriArgyris, FacetBasis
    from skfem.helpers import dd

    def twist(u: Any, v: Any, w: Any) -> Any:
        a, b = (_across_along(dd(field), w.n) for field in (u, v))
        return 2 * (1 - build.material.poisson_ratio) * a * b

    sides = mesh.boundary_facets()
    held = {
        side
        for edge in build.edges
        for side in on_stretch(middles(mesh), frame.local(stretch(build, edge)))
    }
    ends = mesh.p[:, mesh.facets[:, sides]]
    long_enough = (
        np.linalg.norm(ends[:, 0] - ends[:, 1], axis=0) > 2 * build.thickness_m / frame.unit_m
    )
    free = sides[long_enough & ~np.isin(sides, list(held))]
    if not free.size:
        return 0
    return BilinearForm(twist).assemble(
        FacetBasis(mesh, ElementTriArgyris(), facets=free, intorder=_ORDER)
    )


def _across_along(second: Any, normal: Any) -> Any:
    """The mixed second derivative across and along an edge."""
    x, y = normal
    return (second[1, 1] - second[0, 0]) * x * y + second[0, 1] * (x * x - y * y)
