"""Kirchhoff's plate by Argyris' triangle: stiffness, mass, and what rows of it are held.

Argyris, Fried and Scharpf (Aeronaut. J. 72, 1968): complete polynomials of degree five with continuous slopes, as
Kirchhoff's plate needs them. Frequencies converge with the eighth power of the mesh size.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...array_types import Floats
from .boundary_conditions import free_unknowns, middles, on_stretch
from .build import PlateBuild
from .frame import PlateFrame, deflections
from .mesh import mesh_of, stretch
from .outline import Point

_ORDER = 10  # of quadrature: products of two quintics


@dataclass(frozen=True, eq=False)
class Elements:
    """Sparse matrices over all unknowns (u), and `free` (u, v): unknowns from those that nothing holds.

    `frame` is that of the mesh.
    """

    basis: Any
    stiffness: Any
    mass: Any
    free: Any
    frame: PlateFrame

    def rows(self, points: Sequence[Point]) -> Floats:
        """Deflection at points from the unknowns, (points, u). Raises `ValueError` for a point off the plate."""
        return deflections(self.basis, self.frame.local(np.array(points, dtype=np.float64).reshape(-1, 2)))


def elements_of(build: PlateBuild, length_m: float, edge_layer_m: float = 0.0) -> Elements:
    """Of the plate with its masses, springs and held edges, by triangles with sides up to `length_m`.

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
    held = {side for edge in build.edges for side in on_stretch(middles(mesh), frame.local(stretch(build, edge)))}
    ends = mesh.p[:, mesh.facets[:, sides]]
    long_enough = np.linalg.norm(ends[:, 0] - ends[:, 1], axis=0) > 2 * build.thickness_m / frame.unit_m
    free = sides[long_enough & ~np.isin(sides, list(held))]
    if not free.size:
        return 0
    return BilinearForm(twist).assemble(FacetBasis(mesh, ElementTriArgyris(), facets=free, intorder=_ORDER))


def _across_along(second: Any, normal: Any) -> Any:
    """The mixed second derivative across and along an edge."""
    x, y = normal
    return (second[1, 1] - second[0, 0]) * x * y + second[0, 1] * (x * x - y * y)
