"""The outline of a plate: any simple polygon.

What holds a stretch of a plate's edge.

Glossary: t along the edge, n normal to it, w deflection. Argyris' element has w, its gradient and
its three second derivatives at every corner, and the slope across every side at its middle.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ...array_types import Floats

Point = tuple[float, float]


def area(corners: Floats) -> float:
    """Area of a polygon in the square of the corners' unit; negative where they go clockwise.

    Parameters:
        corners: Corners (n, 2) in their order.
    """
    x, y = corners.T
    return float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y) / 2)


def checked_outline(outline: tuple[Point, ...]) -> None:
    """Refuses an outline that is no simple polygon.

    Parameters:
        outline: Corners (x, y) in m, in their order.

    Raises:
        ValueError: For fewer than three corners, numbers that are none, and sides that touch or
            cross.
    """
    corners = np.array(outline, dtype=np.float64)
    if (
        corners.ndim != 2
        or corners.shape[0] < 3
        or corners.shape[1] != 2
        or not np.isfinite(corners).all()
    ):
        raise ValueError(f"outline_m = {outline!r}: expected three corners (x, y) or more")
    n = len(corners)
    for i in range(n):
        if _fold_back(corners[i - 1], corners[i], corners[(i + 1) % n]):
            raise ValueError(
                f"outline_m: the sides at corner {i} fold back; expected a simple polygon"
            )
    apart = [(i, j) for i in range(n) for j in range(i + 2, n) if (i, j) != (0, n - 1)]
    for i, j in apart:
        if _touch(corners[[i, i + 1]], corners[[j, (j + 1) % n]]):
            raise ValueError(
                f"outline_m: sides {i} and {j} touch or cross; expected a simple polygon"
            )


def canonical(corners: Floats) -> Floats:
    """The same polygon counter-clockwise from its leftmost (then lowest) corner: one mesh for one
    plate.

    Parameters:
        corners: Corners (n, 2) in their order, either way round.
    """
    turned = corners if area(corners) > 0 else corners[::-1]
    first = np.lexsort((turned[:, 1], turned[:, 0]))[0]
    return np.roll(turned, -first, axis=0)


def with_corners(corners: Floats, extra: Floats) -> Floats:
    """The polygon with further points of its sides as corners; those that are corners already stay
    single.

    Parameters:
        corners: Corners (n, 2) in their order.
        extra: The further points (k, 2).
    """
    size = float(np.ptp(corners, axis=0).max())
    for point in extra:
        if np.min(np.linalg.norm(corners - point, axis=1)) < 1e-9 * size:
            continue
        start, side = corners, np.roll(corners, -1, axis=0) - corners
        along = np.clip(np.sum((point - start) * side, axis=1) / np.sum(side**2, axis=1), 0, 1)
        nearest = int(np.argmin(np.linalg.norm(start + along[:, None] * side - point, axis=1)))
        corners = np.insert(corners, nearest + 1, point, axis=0)
    return corners


def _touch(a: Floats, b: Floats) -> bool:
    """Whether two sides (2, 2) have a point in common."""
    ends = ((a, b[0]), (a, b[1]), (b, a[0]), (b, a[1]))
    signs = [np.sign(_cross(s[1] - s[0], r - s[0])) for s, r in ends]
    if signs[0] * signs[1] < 0 and signs[2] * signs[3] < 0:
        return True
    return any(
        sign == 0 and np.dot(s[0] - r, s[1] - r) <= 0
        for sign, (s, r) in zip(signs, ends, strict=True)
    )


def _fold_back(begin: Floats, corner: Floats, end: Floats) -> bool:
    """Whether the second of two sides that meet at a corner runs back along the first, or has no
    length."""
    a, b = begin - corner, end - corner
    return bool(not a.any() or not b.any() or (_cross(a, b) == 0 and np.dot(a, b) > 0))


def _cross(a: Floats, b: Floats) -> float:
    return float(a[0] * b[1] - a[1] * b[0])


@dataclass(frozen=True)
class Edge(ABC):
    """A stretch of a side, from `start` to `stop` in shares of its length. Raises `ValueError` for
    none such."""

    side: int
    start: float = 0.0
    stop: float = 1.0

    #: Whether the slope across the edge is held, too.
    holds_slope: ClassVar[bool]

    def __post_init__(self) -> None:
        if not 0 <= self.start < self.stop <= 1:
            raise ValueError(
                f"stretch from {self.start!r} to {self.stop!r}: expected 0 <= start < stop <= 1"
            )

    @abstractmethod
    def rows(self, along: Floats) -> Floats:
        """What is zero at a corner of the mesh, as rows over (w, w_x, w_y, w_xx, w_xy, w_yy).

        Parameters:
            along: t, the unit vector along the edge (2,).
        """


@dataclass(frozen=True)
class SimplySupported(Edge):
    """w = 0 along the stretch, and with it w_t and w_tt; it turns freely."""

    holds_slope = False

    def rows(self, along: Floats) -> Floats:
        """w, w_t and w_tt, as rows (3, 6).

        Parameters:
            along: t, the unit vector along the edge (2,).
        """
        x, y = along
        return np.array(
            [[1, 0, 0, 0, 0, 0], [0, x, y, 0, 0, 0], [0, 0, 0, x * x, 2 * x * y, y * y]]
        )


@dataclass(frozen=True)
class Clamped(SimplySupported):
    """w = 0 and w_n = 0 along the stretch, and with them w_t, w_tt and w_nt."""

    holds_slope = True

    def rows(self, along: Floats) -> Floats:
        """w, w_t, w_tt, w_n and w_nt, as rows (5, 6).

        Parameters:
            along: t, the unit vector along the edge (2,).
        """
        x, y = along
        slope = np.array([[0, -y, x, 0, 0, 0], [0, 0, 0, -x * y, x * x - y * y, x * y]])
        return np.concatenate([super().rows(along), slope])
