"""A gap table as one long vector: the cells that have a mean, and covariances between them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from ..gap import GapTable
from .creep import Creep

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Cells:
    """N cells: `configuration` and `observable` of each (N,), `z` (N,) the gap in it, all in tolerances.

    `noise` (N, N) is what repetitions leave in the means, and what uncertain nominal parameters do. `creep` is what
    repetitions say beside their means.
    """

    configuration: NDArray[np.intp]
    observable: NDArray[np.intp]
    z: Floats
    noise: Floats
    tolerance: Floats
    creep: Creep

    @classmethod
    def of(cls, gap: GapTable) -> Self:
        c, o = np.nonzero(gap.count > 0)
        tolerance = gap.tolerance[o]
        number = gap.count[c, o].astype(np.float64)
        same = c[:, None] == c[None, :]
        shared = np.sqrt(number[:, None] * number[None, :])
        noise = np.where(same, gap.noise.covariance[np.ix_(o, o)] / shared, 0.0)
        # a nominal parameter that is not known well is marginalised in every hypothesis alike
        doubts = gap.nuisances[:, c, o]
        noise = noise + doubts.T @ doubts
        z = gap.mean[c, o] / tolerance
        return cls(c, o, z, noise / np.outer(tolerance, tolerance), tolerance, Creep.of(gap))

    def take(self, table: Floats) -> Floats:
        """(..., C, D) to (..., N), in tolerances."""
        return np.asarray(table[..., self.configuration, self.observable] / self.tolerance)
