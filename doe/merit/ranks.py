"""Where the levels of an axis lie between 0 and 1, for measures that need a place."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from ..space import Axis, Space


def axis_centres(space: Space) -> list[Floats]:
    """Per axis, the centre of each level's cell, (levels,): the range cut into as many equal cells as levels.

    Discrepancies depend on the order of the levels, which combinations of factors do not have by nature. They stand
    here in the order of their last factor, then of the one before: none, aluminum, steel without insulator, then
    aluminum, steel with it. In this order Table A.1 has the discrepancies that are quoted for it.
    """
    return [(_ranks(axis) + 0.5) / axis.size for axis in space.axes]


def centres(space: Space, treatments: NDArray[np.int64]) -> Floats:
    """Points in the unit cube, (n, axes), of treatments (n, axes)."""
    return np.stack([places[treatments[:, axis]] for axis, places in enumerate(axis_centres(space))], axis=1)


def _ranks(axis: Axis) -> NDArray[np.int64]:
    order = sorted(range(axis.size), key=lambda index: axis.combinations[index][::-1])
    return np.argsort(order).astype(np.int64)
