"""What holds a stretch of a plate's edge.

Glossary: t along the edge, n normal to it, w deflection. Argyris' element has w, its gradient and its three second
derivatives at every corner, and the slope across every side at its middle.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ...array_types import Floats


@dataclass(frozen=True)
class Edge(ABC):
    """A stretch of a side, from `start` to `stop` in shares of its length. Raises `ValueError` for none such."""

    side: int
    start: float = 0.0
    stop: float = 1.0

    #: Whether the slope across the edge is held, too.
    holds_slope: ClassVar[bool]

    def __post_init__(self) -> None:
        if not 0 <= self.start < self.stop <= 1:
            raise ValueError(f"stretch from {self.start!r} to {self.stop!r}: expected 0 <= start < stop <= 1")

    @abstractmethod
    def rows(self, along: Floats) -> Floats:
        """What is zero at a corner of the mesh, as rows over (w, w_x, w_y, w_xx, w_xy, w_yy); `along` is t (2,)."""


@dataclass(frozen=True)
class SimplySupported(Edge):
    """w = 0 along the stretch, and with it w_t and w_tt; it turns freely."""

    holds_slope = False

    def rows(self, along: Floats) -> Floats:
        x, y = along
        return np.array([[1, 0, 0, 0, 0, 0], [0, x, y, 0, 0, 0], [0, 0, 0, x * x, 2 * x * y, y * y]])


@dataclass(frozen=True)
class Clamped(SimplySupported):
    """w = 0 and w_n = 0 along the stretch, and with them w_t, w_tt and w_nt."""

    holds_slope = True

    def rows(self, along: Floats) -> Floats:
        x, y = along
        slope = np.array([[0, -y, x, 0, 0, 0], [0, 0, 0, -x * y, x * x - y * y, x * y]])
        return np.concatenate([super().rows(along), slope])
