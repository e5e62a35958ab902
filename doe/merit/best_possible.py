"""What any design of so many runs could reach at best, and what runs drawn at random reach: the two
marks between which the figures of a design are read."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from functools import lru_cache

import numpy as np

from ...array_types import Levels
from ..space import Space
from .quality import FIGURES, quality
from .space_filling import d_efficiency_limit

#: Random designs whose median is shown: enough for two digits, and done in a quarter of a second.
_DRAWS = 40


def best_possible(space: Space, runs: int) -> dict[str, float]:
    """Figure of `quality.FIGURES` to its bound for any `runs` treatments of the space; figures
    without one are absent.

    Counts are whole, so that a share that is no whole number is missed by every design. Each bound
    holds, but there need not be a design that reaches all of them. The two most similar runs differ
    in no more axes than two runs do on average (Plotkin), and than leaves the rest of the axes
    enough different rows (Singleton). Raises `ValueError` for less than one run.
    """
    if runs < 1:
        raise ValueError(f"runs is {runs}; expected 1 or more")
    cells = [axis.strata for axis in space.axes]
    values = [axis.size for axis in space.axes]
    linear = [index for index, axis in enumerate(space.axes) if axis.continuous]
    return {
        "distinct": min(runs, space.size),
        "worst_level": _evenness(cells, runs, 1),
        "worst_pair": _evenness(cells, runs, 2),
        "worst_triple": _evenness(cells, runs, 3),
        "rms_triple": _rms_evenness(cells, runs, 3),
        "uneven_triples": 0,
        "fewest_differences": _most_differences(values, runs),
        "largest_correlation": 0.0,
        "d_efficiency": d_efficiency_limit(values, linear),
    }


def _shares(sizes: Sequence[int], runs: int, order: int) -> list[tuple[int, float]]:
    """Cells and share of every set of `order` axes."""
    counts = [
        math.prod(sizes[axis] for axis in axes)
        for axes in itertools.combinations(range(len(sizes)), order)
    ]
    return [(count, runs / count) for count in counts]


def _evenness(sizes: Sequence[int], runs: int, order: int) -> float:
    """The worst deviation that whole counts leave: a cell must have the next whole number above its
    share."""
    return max(
        (max(_up(share), share - math.floor(share)) for _, share in _shares(sizes, runs, order)),
        default=0.0,
    )


def _up(share: float) -> float:
    return math.ceil(share) - share


def _rms_evenness(sizes: Sequence[int], runs: int, order: int) -> float:
    squares, cells = 0.0, 0
    for count, share in _shares(sizes, runs, order):
        above = runs - count * math.floor(share)  # cells that have one run more than the others
        squares += above * _up(share) ** 2 + (count - above) * (share - math.floor(share)) ** 2
        cells += count
    return math.sqrt(squares / cells) if cells else 0.0


def _most_differences(sizes: Sequence[int], runs: int) -> int:
    if runs == 1:
        return len(sizes)
    if runs > math.prod(sizes):
        return 0
    # Pairs of runs that share a level are fewest where the levels are as even as can be.
    pairs = runs * (runs - 1) / 2
    average = 0.0
    for size in sizes:
        low, above = divmod(runs, size)
        alike = above * (low + 1) * low / 2 + (size - above) * low * (low - 1) / 2
        average += 1 - alike / pairs
    rising = sorted(sizes)
    enough = [
        d for d in range(1, len(sizes) + 1) if math.prod(rising[: len(sizes) - d + 1]) >= runs
    ]
    return min(math.floor(average + 1e-9), max(enough))


@lru_cache(maxsize=64)
def random_reference(space: Space, runs: int) -> Mapping[str, float]:
    """Figure of `quality.FIGURES` to its median over runs drawn at random from all treatments, 40
    times, seed 0."""
    rng = np.random.default_rng(0)
    sizes = np.array([axis.size for axis in space.axes])
    designs: list[Levels] = [rng.integers(0, sizes, (runs, len(sizes))) for _ in range(_DRAWS)]
    judged = [quality(space, treatments) for treatments in designs]
    return {
        name: float(np.median([getattr(figures, name) for figures in judged])) for name in FIGURES
    }
