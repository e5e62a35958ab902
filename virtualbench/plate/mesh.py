"""A quadrilateral cut into rows and columns of elements, and where its nodes are.

Glossary: (u, v) the unit square that the bilinear map carries to the plate, corner k of the outline at (0, 0), (1, 0),
(1, 1), (0, 1); p the degree; a node carries three unknowns: the deflection and two rotations.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from .build import Clamp, Point
from .elements import UNKNOWNS, basis, lobatto_nodes

__all__ = ["Mesh", "bilinear"]

_NEWTON_STEPS = 30
_OUTSIDE = 1e-9


@dataclass(frozen=True)
class Mesh:
    """Elements of degree `degree` between the lines `u` (columns + 1,) and `v` (rows + 1,), both rising from 0 to 1."""

    corners_m: NDArray[np.float64]  # (4, 2)
    u: NDArray[np.float64]
    v: NDArray[np.float64]
    degree: int

    @classmethod
    def regular(
        cls, outline_m: tuple[Point, ...], columns: int, rows: int, degree: int, clamps: tuple[Clamp, ...] = ()
    ) -> Mesh:
        """At least so many columns and rows of about one size, with a line where a clamp begins or ends."""
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
        return np.asarray((UNKNOWNS * nodes[:, :, None] + np.arange(UNKNOWNS)).reshape(nodes.shape[0], -1))

    def edge_nodes(self, clamp: Clamp) -> NDArray[np.intp]:
        """Nodes on a stretch of an edge."""
        along = _node_positions(self.v if clamp.edge % 2 else self.u, self.degree)
        numbers = np.arange(self.shape[0] * self.shape[1]).reshape(self.shape)
        row = (numbers[:, 0], numbers[-1, :], numbers[:, -1], numbers[0, :])[clamp.edge]
        position = along if clamp.edge < 2 else 1 - along
        return np.asarray(row[(position > clamp.start - _OUTSIDE) & (position < clamp.stop + _OUTSIDE)])

    def deflection_at(self, point_m: Point) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
        """Unknowns and their weights that give the deflection at a point. Raises `ValueError` off the plate."""
        u, v = self.locate(point_m)
        (i, weights_u), (j, weights_v) = _cell(self.u, u, self.degree), _cell(self.v, v, self.degree)
        unknowns = self.element_unknowns()[i * (self.v.size - 1) + j, ::UNKNOWNS]
        return unknowns, np.outer(weights_u, weights_v).ravel()

    def locate(self, point_m: Point) -> tuple[float, float]:
        """(u, v) of a point, by Newton's method. Raises `ValueError` for a point off the plate."""
        target, at = np.array(point_m, dtype=float), np.array([0.5, 0.5])
        for _ in range(_NEWTON_STEPS):
            position, slopes = bilinear(self.corners_m, at[:1], at[1:])
            at = at + np.linalg.solve(slopes[0].T, target - position[0])
        if not (np.all(at > -_OUTSIDE) and np.all(at < 1 + _OUTSIDE)):
            raise ValueError(f"point {point_m!r} is off the plate with corners {self.corners_m.tolist()}")
        return float(np.clip(at[0], 0, 1)), float(np.clip(at[1], 0, 1))


def bilinear(
    corners: NDArray[np.float64], u: NDArray[np.float64], v: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Positions (n, 2) and their slopes (n, 2, 2): the derivative along u first, then along v."""
    a, b, c, d = corners
    u, v = u[:, None], v[:, None]
    position = a * (1 - u) * (1 - v) + b * u * (1 - v) + c * u * v + d * (1 - u) * v
    along_u, along_v = (b - a) * (1 - v) + (c - d) * v, (d - a) * (1 - u) + (c - b) * u
    return position, np.stack([along_u, along_v], axis=1)


def _lines(count: int, breaks: set[float]) -> NDArray[np.float64]:
    stops = sorted(breaks)
    parts = [np.linspace(a, b, int(np.ceil((b - a) * count - _OUTSIDE)) + 1)[:-1] for a, b in pairwise(stops)]
    return np.append(np.concatenate(parts), 1.0)


def _node_positions(lines: NDArray[np.float64], degree: int) -> NDArray[np.float64]:
    inner = (lobatto_nodes(degree)[:-1] + 1) / 2
    return np.append((lines[:-1, None] + np.diff(lines)[:, None] * inner).ravel(), lines[-1])


def _cell(lines: NDArray[np.float64], at: float, degree: int) -> tuple[int, NDArray[np.float64]]:
    k = int(np.clip(np.searchsorted(lines, at, side="right") - 1, 0, lines.size - 2))
    local = 2 * (at - lines[k]) / (lines[k + 1] - lines[k]) - 1
    return k, basis(degree, np.array([local]))[0][0]
