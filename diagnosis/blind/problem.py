"""A campaign as the simple ways of answering see it: arrays, in tolerances."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from ..evidence.cells import Cells
from ..evidence.surface import Surface
from ..gap import GapTable

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Problem:
    """N cells: means of a configuration's residuals in one observable.

    `z` (N,) the gap, `noise` (N, N) its covariance from repetitions, `stage`, `configuration` and `observable` of
    each. `changes` by effect: (M, N), what it does at M places of its parameters; `parameters` how many it has.
    """

    z: Floats
    noise: Floats
    stage: NDArray[np.str_]
    configuration: NDArray[np.intp]
    observable: NDArray[np.intp]
    changes: Mapping[str, Floats]
    parameters: Mapping[str, int]

    @classmethod
    def of(cls, gap: GapTable, surfaces: Sequence[Surface] = (), most: int = 400) -> Self:
        """At most so many places of each sheet of parameters, evenly taken."""
        cells = Cells.of(gap)
        changes: dict[str, list[Floats]] = {}
        for surface in surfaces:
            rows = np.flatnonzero(surface.valid)
            rows = rows[:: -(-len(rows) // most)]
            changes.setdefault(surface.id, []).append(np.asarray(surface.basis[rows] @ cells.take(surface.nodes)))
        return cls(
            cells.z,
            cells.noise,
            np.array([gap.observables[int(o)].stage for o in cells.observable]),
            cells.configuration,
            cells.observable,
            {name: np.concatenate(tables) for name, tables in changes.items()},
            {surface.id: len(surface.sheet.axes) for surface in surfaces},
        )
