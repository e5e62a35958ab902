"""Where points lie in the mesh: its frame, its triangles, and deflections there."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...array_types import Floats


@dataclass(frozen=True, eq=False)
class PlateFrame:
    """Lengths in `unit_m`, from the middle of the plate.

    The unknowns are then all of the size of the deflections, and the powers of x and y, which the element is made of,
    stay small.
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
        out[np.arange(len(points)), basis.element_dofs[i, where]] = basis.elem.gbasis(basis.mapping, at, i, where)[0][
            :, 0
        ]
    return out


def _located(mesh: Any, points: Floats) -> tuple[Floats, Any]:
    """Coordinates (2, n, 1) of points (n, 2) within their triangles, and the triangles."""
    corners = mesh.p[:, mesh.t]  # (2, 3, triangles)
    edges = np.stack([corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]], axis=1)
    local = np.einsum(
        "tij,jnt->int", np.linalg.inv(edges.transpose(2, 0, 1)), points.T[:, :, None] - corners[:, None, 0]
    )
    inside = np.minimum(local.min(axis=0), 1 - local.sum(axis=0))
    where = np.argmax(inside, axis=1)
    rows = np.arange(len(points))
    if np.any(off := inside[rows, where] < -1e-6):
        raise ValueError(f"{off.sum()} of {off.size} points lie off the plate")
    return local[:, rows, where, None], where
