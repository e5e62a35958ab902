"""Designs that fill a unit cube, each axis of it cut into the levels of a factor: pyDOE3's
hypercubes and sequences.

Runs may repeat a treatment where factors have few levels. `lhs.balance_levels` is better where
balance of levels matters (benchmarks/designs.py); these are for comparison, and for spaces of
continuous factors.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..space import Space
from . import pydoe
from .base import Design


def latin_hypercube(space: Space, n: int, rng: np.random.Generator, criterion: str) -> Design:
    """`n` runs of a Latin hypercube that is the best of several by `criterion`; raises as
    `pydoe.unit_lhs`."""
    return _rounded(space, pydoe.unit_lhs(n, len(space.axes), rng, criterion), "lhs")


def sobol(space: Space, n: int, rng: np.random.Generator) -> Design:
    """The first `n` runs of a scrambled Sobol' sequence; powers of two are the most even."""
    return _rounded(space, pydoe.unit_sobol(n, len(space.axes), rng), "sobol")


def halton(space: Space, n: int, rng: np.random.Generator) -> Design:
    """The first `n` runs of Halton's sequence, shifted at random."""
    return _rounded(space, pydoe.unit_halton(n, len(space.axes), rng), "halton")


def _rounded(space: Space, points: NDArray[np.float64], method: str) -> Design:
    sizes = np.array([axis.size for axis in space.axes])
    levels = np.minimum(np.floor(points * sizes), sizes - 1).astype(np.int64)
    return Design(space, levels, method, None)
