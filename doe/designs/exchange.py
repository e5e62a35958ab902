"""Swaps of levels between runs, accepted as in simulated annealing: the level counts of every axis
stay as they are.

A step takes one run and looks at every swap of one level with every other run. Among these and the
choice of staying it draws by the Boltzmann distribution (a heat bath), so that no step is lost on
rejected trials. The number of steps is given and no clock is read: the same seed gives the same
runs.

The annealing of `exchange`, compiled, for a design in a landscape that is tabulated whole.

A step weighs hundreds of swaps, each of a few additions: in NumPy nearly all of its time is that of
calls.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit

from ...array_types import Floats, Ids
from .criterion import Kernel

#: In units of the criterion: at first a cell's count one off its share is drawn freely, in the end
#: hardly.
FIRST_TEMPERATURE, LAST_TEMPERATURE = 1.6, 0.7
#: Runs that a step looks at where nothing is tabulated.
_PARTNERS = 6


class TabulatedCriterion:
    """The criterion of counts (size,) of treatments with a design's runs added to them (sign 1) or
    taken away (-1).

    `levels` (size, axes) are those of all treatments; `penalty` (size,) is for each treatment among
    the runs.
    """

    def __init__(
        self, kernel: Kernel, levels: Ids, counts: Floats, sign: float, penalty: Floats
    ) -> None:
        self.table = np.vstack([kernel.between(level, levels) for level in levels])
        # No product of BLAS: its last digits depend on the number of threads.
        beside = (self.table * counts).sum(axis=1)
        self.baseline = sign * (2 * beside + kernel.alone(levels)) + penalty

    def height(self, runs: Ids) -> float:
        """The criterion of runs (n,), but for what the counts have alone."""
        return float(self.table[np.ix_(runs, runs)].sum() + self.baseline[runs].sum())


class DirectCriterion:
    """A design of `runs` (n,) beside `others`, its criterion computed when asked for: for spaces of
    any size, and slow.

    Treatments are numbers: the flat index of their levels.
    """

    def __init__(self, kernel: Kernel, sizes: tuple[int, ...], runs: Ids, others: Ids) -> None:
        self._kernel, self._sizes = kernel, sizes
        self._runs = np.concatenate([runs, others])

    def between(self, x: Ids, y: Ids) -> Floats:
        """Of treatments x and y, broadcasting."""
        return self._kernel.between(self._levels(x), self._levels(y))

    def field(self, x: Ids) -> Floats:
        """Twice the sum of `between` x (...,) and all runs, with what x brings alone."""
        near = self.between(x[..., None], self._runs)
        return np.asarray(2 * near.sum(axis=-1) + self._kernel.alone(self._levels(x)))

    def own(self, x: Ids) -> Floats:
        """`between` x (...,) and itself."""
        return self.between(x, x)

    def replace(self, old: Ids, new: Ids) -> None:
        """Runs of the design change."""
        for before, after in zip(old, new, strict=True):
            self._runs[np.flatnonzero(self._runs == before)[0]] = after

    def _levels(self, x: Ids) -> Ids:
        return np.stack(np.unravel_index(x, self._sizes), axis=-1)


@dataclass(frozen=True)
class Swaps:
    """All swaps of one level of a run with its partners: what both become (2, partners, axes), and
    the change."""

    partners: Ids
    become: Ids
    change: Floats  #: of the criterion, (partners, axes); infinite where both have the same level


def anneal_tabulated(
    landscape: TabulatedCriterion,
    levels: Ids,
    sizes: tuple[int, ...],
    steps: int,
    rng: np.random.Generator,
) -> Ids:
    """The best runs (n, axes) met in `steps` steps from `levels` (n, axes): every swap of a run is
    looked at."""
    current, strides = levels.copy(), strides_of(sizes)
    field = landscape.baseline + 2 * landscape.table[current @ strides].sum(axis=0)
    return np.asarray(
        annealed(landscape.table, field, current, strides, *_schedule(len(levels), steps, rng))
    )


def anneal(
    surface: DirectCriterion,
    levels: Ids,
    sizes: tuple[int, ...],
    steps: int,
    rng: np.random.Generator,
    partners: int = _PARTNERS,
) -> Ids:
    """The same where nothing is tabulated; a step looks at the swaps with `partners` runs of the
    surface's design."""
    current, strides = levels.copy(), strides_of(sizes)
    best, height, lowest = current.copy(), 0.0, 0.0
    for row, draw, temperature in zip(*_schedule(len(levels), steps, rng), strict=True):
        others = np.arange(len(levels))
        if partners < len(levels):
            others = rng.choice(len(levels), size=partners, replace=False)
        swaps = swaps_of(surface, current, strides, row, others)
        choice = _drawn_change(swaps.change.ravel(), temperature, draw)
        if choice is None:
            continue
        place, axis = divmod(choice, len(sizes))
        pair = [row, int(others[place])]
        surface.replace(current[pair] @ strides, swaps.become[:, place, axis])
        current[pair, axis] = current[pair[::-1], axis]
        height += float(swaps.change[place, axis])
        if height < lowest - 1e-9:
            best, lowest = current.copy(), height
    return best


def _schedule(runs: int, steps: int, rng: np.random.Generator) -> tuple[Ids, Floats, Floats]:
    """Of each step: the run, a number in [0, 1) and the temperature. A single run has nobody to
    swap with."""
    count = steps if runs > 1 else 0
    return (
        rng.integers(runs, size=count),
        rng.random(count),
        np.geomspace(FIRST_TEMPERATURE, LAST_TEMPERATURE, count),
    )


def swaps_of(surface: DirectCriterion, levels: Ids, strides: Ids, row: int, partners: Ids) -> Swaps:
    """What the swaps of `row` with each partner and each axis would do; `levels` (n, axes) are the
    design's."""
    step = (levels[partners] - levels[row]) * strides
    a, b = np.asarray(levels[row] @ strides), (levels[partners] @ strides)[:, None]
    become = np.stack([a + step, b - step])
    gain = surface.field(become) + surface.own(become)
    gain -= 2 * (surface.between(a, become) + surface.between(b, become))
    # Swapped or not, two runs agree on the same axes: what is between them counts for both.
    loss = (
        surface.field(a)
        - surface.own(a)
        + surface.field(b)
        - surface.own(b)
        - 4 * surface.between(a, b)
    )
    change = gain[0] + gain[1] - loss
    change[step == 0] = np.inf
    return Swaps(partners, become, change)


def _drawn_change(change: Floats, temperature: float, draw: float) -> int | None:
    """Which change is made, by the Boltzmann distribution; None for none."""
    floor = min(0.0, float(change.min()))
    total = np.exp((floor - change) / temperature).cumsum()
    drawn = draw * (total[-1] + np.exp(floor / temperature))
    return int(total.searchsorted(drawn, side="right")) if drawn < total[-1] else None


def strides_of(sizes: tuple[int, ...]) -> Ids:
    """What a step of each axis is worth in the number of a treatment."""
    return np.array(
        [int(np.prod(sizes[axis + 1 :], dtype=np.int64)) for axis in range(len(sizes))],
        dtype=np.int64,
    )


@njit(cache=True)
def annealed(
    table: Floats,
    field: Floats,
    levels: Ids,
    strides: Ids,
    rows: Ids,
    draws: Floats,
    temperatures: Floats,
) -> Ids:
    """The best runs (n, axes) met from `levels` (n, axes), a step for each of `rows`, `draws` and
    `temperatures`.

    `table` (size, size) is the criterion between treatments, `field` (size,) twice its sum with all
    runs and what a treatment brings alone. `field` and `levels` are changed. A step swaps one level
    of a run with another run, drawn by the Boltzmann distribution from all such swaps and the
    choice of staying.
    """
    n, axes = levels.shape
    ids = (levels * strides).sum(axis=1)
    change, total = np.empty(n * axes), np.empty(n * axes)
    best, height, lowest = levels.copy(), 0.0, 0.0
    for step in range(len(rows)):
        row, temperature = rows[step], temperatures[step]
        a, floor = ids[row], 0.0
        for partner in range(n):
            b = ids[partner]
            loss = field[a] - table[a, a] + field[b] - table[b, b] - 4 * table[a, b]
            for axis in range(axes):
                moved = (levels[partner, axis] - levels[row, axis]) * strides[axis]
                if moved == 0:
                    change[partner * axes + axis] = np.inf
                    continue
                x, y = a + moved, b - moved
                gain = field[x] + table[x, x] - 2 * (table[a, x] + table[b, x])
                gain += field[y] + table[y, y] - 2 * (table[a, y] + table[b, y])
                change[partner * axes + axis] = gain - loss
                floor = min(floor, gain - loss)
        reached = 0.0
        for cell_step in range(n * axes):
            reached += math.exp((floor - change[cell_step]) / temperature)
            total[cell_step] = reached
        drawn = draws[step] * (reached + math.exp(floor / temperature))
        if drawn >= reached:
            continue
        choice = np.searchsorted(total, drawn, side="right")
        partner, axis = choice // axes, choice % axes
        b = ids[partner]
        moved = (levels[partner, axis] - levels[row, axis]) * strides[axis]
        for treatment in range(len(field)):
            new = table[a + moved, treatment] + table[b - moved, treatment]
            field[treatment] += 2 * (new - table[a, treatment] - table[b, treatment])
        ids[row], ids[partner] = a + moved, b - moved
        levels[row, axis], levels[partner, axis] = levels[partner, axis], levels[row, axis]
        height += change[choice]
        if height < lowest - 1e-9:
            best, lowest = levels.copy(), height
    return best
