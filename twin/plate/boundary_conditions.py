"""What held edges leave of the unknowns of Argyris' elements."""

from __future__ import annotations

from collections import defaultdict
from typing import Any

import numpy as np

from ...array_types import Floats
from .build import PlateBuild
from .frame import PlateFrame
from .mesh import stretch

_NODAL = 6


def free_unknowns(build: PlateBuild, basis: Any, frame: PlateFrame) -> Any:
    """Columns span what the held edges leave, corner by corner of the mesh; orthonormal there."""
    from scipy.sparse import coo_matrix

    rules, fixed = _held(build, basis, frame)
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
    return coo_matrix((np.array(values), (np.array(rows), np.array(cols))), shape=(basis.N, count)).tocsc()


def _held(build: PlateBuild, basis: Any, frame: PlateFrame) -> tuple[dict[int, list[Floats]], set[int]]:
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
