"""A quadrilateral cut into rows and columns of elements, and where its nodes are.

Glossary: (u, v) the unit square that the bilinear map carries to the plate, corner k of the outline
at (0, 0), (1, 0), (1, 1), (0, 1); p the degree; a node carries three unknowns: the deflection and
two rotations.

The spectral element: Lagrange polynomials of high degree on Gauss-Lobatto nodes.

A high degree keeps a Mindlin element from locking when the plate is thin, and converges so fast
that a plate's first hundreds of modes need some thousands of unknowns (Karniadakis and Sherwin,
Spectral/hp Element Methods, 2005).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from itertools import pairwise

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

from ...array_types import Floats
from .build import Clamp, PlateMaterial, Point

#: Unknowns of a node: the deflection w, and rotations such that the shear is their sum with the
#: slopes of w.
UNKNOWNS = 3
#: Reissner's value for a parabolic shear stress.
SHEAR_CORRECTION = 5 / 6


@cache
def lobatto_nodes(degree: int) -> Floats:
    """The (degree + 1,) points from -1 to 1: the ends, and the extrema of the Legendre polynomial
    between them."""
    extrema = legendre.legroots(legendre.legder(np.eye(degree + 1)[degree]))
    return np.concatenate([[-1.0], np.sort(extrema.real), [1.0]])


def basis(degree: int, x: Floats) -> tuple[Floats, Floats]:
    """Values and slopes (n, degree + 1) of the Lagrange polynomials of `lobatto_nodes` at `x`
    (n,)."""
    to_legendre = np.linalg.inv(legendre.legvander(lobatto_nodes(degree), degree))
    slopes = legendre.legder(np.eye(degree + 1), axis=0)
    return legendre.legvander(x, degree) @ to_legendre, legendre.legvander(
        x, degree - 1
    ) @ slopes @ to_legendre


def stiffness_matrices(
    values: Floats, gradients: Floats, weights: Floats, material: PlateMaterial, thickness_m: float
) -> Floats:
    """Stiffness (elements, 3n, 3n) of Mindlin's plate (1951): bending by the rotations, shear by
    them and the slope.

    Shape functions `values` (q, n), `gradients` (elements, q, 2, n) and quadrature `weights`
    (elements, q), in m^2.
    """
    elements, points, _, nodes = gradients.shape
    x, y = gradients[:, :, 0], gradients[:, :, 1]
    curvature = np.zeros((elements, points, 3, nodes, 3))
    curvature[:, :, 0, :, 1], curvature[:, :, 1, :, 2] = x, y
    curvature[:, :, 2, :, 1], curvature[:, :, 2, :, 2] = y, x
    shear = np.zeros((elements, points, 2, nodes, 3))
    shear[:, :, 0, :, 0], shear[:, :, 1, :, 0] = x, y
    shear[:, :, 0, :, 1], shear[:, :, 1, :, 2] = values, values
    bending, shearing = _rigidities(material, thickness_m)
    return _quadratic(curvature, bending, weights) + _quadratic(shear, shearing, weights)


def mass_matrices(
    values: Floats, weights: Floats, density_kg_m3: float, thickness_m: float
) -> Floats:
    """Mass (elements, 3n, 3n): translation, and rotary inertia h^3 / 12."""
    inertia = density_kg_m3 * np.array([thickness_m, thickness_m**3 / 12, thickness_m**3 / 12])
    scalar = np.einsum("qa,eq,qb->eab", values, weights, values, optimize=True)
    size = UNKNOWNS * values.shape[1]
    return np.asarray(np.einsum("eab,cd->eacbd", scalar, np.diag(inertia)).reshape(-1, size, size))


def _rigidities(material: PlateMaterial, thickness_m: float) -> tuple[Floats, Floats]:
    nu = material.poisson_ratio
    bending = material.young_modulus_pa * thickness_m**3 / (12 * (1 - nu**2))
    plane = np.array([[1, nu, 0], [nu, 1, 0], [0, 0, (1 - nu) / 2]])
    return bending * plane, SHEAR_CORRECTION * material.shear_modulus_pa * thickness_m * np.eye(2)


def _quadratic(strain: Floats, rigidity: Floats, weights: Floats) -> Floats:
    """Sum over quadrature points of strain^T rigidity strain."""
    elements, points, kinds = strain.shape[:3]
    strain = strain.reshape(elements, points, kinds, -1)
    stress = np.einsum("kl,eqln->eqkn", rigidity, strain) * weights[:, :, None, None]
    flat = (elements, points * kinds, strain.shape[-1])
    return np.asarray(strain.reshape(flat).transpose(0, 2, 1) @ stress.reshape(flat))


_NEWTON_STEPS = 30
_OUTSIDE = 1e-9


@dataclass(frozen=True)
class Mesh:
    """Elements of degree `degree` between the lines `u` (columns + 1,) and `v` (rows + 1,), both
    rising from 0 to 1."""

    corners_m: Floats  # (4, 2)
    u: Floats
    v: Floats
    degree: int

    @classmethod
    def regular(
        cls,
        outline_m: tuple[Point, ...],
        columns: int,
        rows: int,
        degree: int,
        clamps: tuple[Clamp, ...] = (),
    ) -> Mesh:
        """At least so many columns and rows of about one size, with a line where a clamp begins or
        ends."""
        breaks: tuple[set[float], set[float]] = ({0.0, 1.0}, {0.0, 1.0})
        for clamp in clamps:
            ends = {clamp.start, clamp.stop}
            breaks[clamp.edge % 2].update(ends if clamp.edge < 2 else {1 - end for end in ends})
        corners = np.array(outline_m, dtype=float)
        return cls(corners, _lines(columns, breaks[0]), _lines(rows, breaks[1]), degree)

    @property
    def shape(self) -> tuple[int, int]:
        """Nodes along u and along v."""
        return (self.u.size - 1) * self.degree + 1, (self.v.size - 1) * self.degree + 1

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return UNKNOWNS * self.shape[0] * self.shape[1]

    def element_unknowns(self) -> NDArray[np.intp]:
        """Unknowns (elements, 3 (p + 1)^2) of every element, columns outermost."""
        p = self.degree
        numbers = np.arange(self.shape[0] * self.shape[1]).reshape(self.shape)
        windows = np.lib.stride_tricks.sliding_window_view(numbers, (p + 1, p + 1))[::p, ::p]
        nodes = windows.reshape(-1, (p + 1) ** 2)
        return np.asarray(
            (UNKNOWNS * nodes[:, :, None] + np.arange(UNKNOWNS)).reshape(nodes.shape[0], -1)
        )

    def edge_nodes(self, clamp: Clamp) -> NDArray[np.intp]:
        """Nodes on a stretch of an edge."""
        along = _node_positions(self.v if clamp.edge % 2 else self.u, self.degree)
        numbers = np.arange(self.shape[0] * self.shape[1]).reshape(self.shape)
        row = (numbers[:, 0], numbers[-1, :], numbers[:, -1], numbers[0, :])[clamp.edge]
        position = along if clamp.edge < 2 else 1 - along
        return np.asarray(
            row[(position > clamp.start - _OUTSIDE) & (position < clamp.stop + _OUTSIDE)]
        )

    def deflection_at(self, point_m: Point) -> tuple[NDArray[np.intp], Floats]:
        """Unknowns and their weights that give the deflection at a point. Raises `ValueError` off
        the plate."""
        u, v = self.locate(point_m)
        (i, weights_u), (j, weights_v) = (
            _cell(self.u, u, self.degree),
            _cell(self.v, v, self.degree),
        )
        unknowns = self.element_unknowns()[i * (self.v.size - 1) + j, ::UNKNOWNS]
        return unknowns, np.outer(weights_u, weights_v).ravel()

    def locate(self, point_m: Point) -> tuple[float, float]:
        """(u, v) of a point, by Newton's method. Raises `ValueError` for a point off the plate."""
        target, at = np.array(point_m, dtype=float), np.array([0.5, 0.5])
        for _ in range(_NEWTON_STEPS):
            position, slopes = bilinear(self.corners_m, at[:1], at[1:])
            at = at + np.linalg.solve(slopes[0].T, target - position[0])
        if not (np.all(at > -_OUTSIDE) and np.all(at < 1 + _OUTSIDE)):
            raise ValueError(
                f"point {point_m!r} is off the plate with corners {self.corners_m.tolist()}"
            )
        return float(np.clip(at[0], 0, 1)), float(np.clip(at[1], 0, 1))


def bilinear(corners: Floats, u: Floats, v: Floats) -> tuple[Floats, Floats]:
    """Positions (n, 2) and their slopes (n, 2, 2): the derivative along u first, then along v."""
    a, b, c, d = corners
    u, v = u[:, None], v[:, None]
    position = a * (1 - u) * (1 - v) + b * u * (1 - v) + c * u * v + d * (1 - u) * v
    along_u, along_v = (b - a) * (1 - v) + (c - d) * v, (d - a) * (1 - u) + (c - b) * u
    return position, np.stack([along_u, along_v], axis=1)


def _lines(count: int, breaks: set[float]) -> Floats:
    stops = sorted(breaks)
    parts = [
        np.linspace(a, b, int(np.ceil((b - a) * count - _OUTSIDE)) + 1)[:-1]
        for a, b in pairwise(stops)
    ]
    return np.append(np.concatenate(parts), 1.0)


def _node_positions(lines: Floats, degree: int) -> Floats:
    inner = (lobatto_nodes(degree)[:-1] + 1) / 2
    return np.append((lines[:-1, None] + np.diff(lines)[:, None] * inner).ravel(), lines[-1])


def _cell(lines: Floats, at: float, degree: int) -> tuple[int, Floats]:
    k = int(np.clip(np.searchsorted(lines, at, side="right") - 1, 0, lines.size - 2))
    local = 2 * (at - lines[k]) / (lines[k + 1] - lines[k]) - 1
    return k, basis(degree, np.array([local]))[0][0]
