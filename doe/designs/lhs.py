"""A Latin hypercube over categorical and ordered axes that is balanced in levels, pairs and
triples.

The thesis (chapter 3) took MATLAB's `lhsdesign` and rounded it to levels, which repeats treatments
and leaves levels and pairs out of balance (Table A.1). Here the hypercube is the start: its ranks
are cut into exactly balanced levels, and swaps of levels between runs, which keep that balance,
even out pairs, triples and discrepancy. Continuous factors are balanced by the parts of their
ranges, and each run has a value of its own within its part (`strata`).

How many runs each level gets, and runs that have exactly that: the start of an exchange, and its
repair.

Values of continuous factors within the parts of their ranges that a balanced design gives to its
runs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...array_types import Floats, Ids
from ..merit.space_filling import axis_centres, centres, discrepancy
from ..space import Axis, Space
from .base import Design
from .criterion import Kernel, Weights
from .exchange import DirectCriterion, TabulatedCriterion, anneal, anneal_tabulated
from .pydoe import unit_lhs


def level_counts(already: Floats, capacity: Ids, n: int, rng: np.random.Generator) -> Ids:
    """Runs `(levels,)` shared out among levels, so that with those that are there already they are
    as even as can be.

    Parameters:
        already: The number of runs that each level has already, of shape `(levels,)`.
        capacity: The largest number of further runs of each level, of shape `(levels,)`.
        n: The number of runs that are shared out.
        rng: Generator of random numbers, which decides which levels get the rest.

    Raises:
        ValueError: For a capacity of fewer than `n` runs in all.
    """
    if capacity.sum() < n:
        raise ValueError(
            f"capacity is {capacity.tolist()}, {int(capacity.sum())} in all; "
            f"expected at least n = {n}"
        )
    counts, turn = (
        np.zeros(len(already), dtype=np.int64),
        rng.permutation(len(already)) / (2 * len(already)),
    )
    for _ in range(n):
        height = np.where(counts < capacity, already + counts + turn, np.inf)
        counts[height.argmin()] += 1
    return counts


def draw_hypercube(counts: Sequence[Ids], n: int, rng: np.random.Generator) -> Ids:
    """Runs `(n, axes)` with a given number at each level: a Latin hypercube's ranks, cut where the
    levels end.

    Parameters:
        counts: For each axis, the number of runs at each of its levels, of shape `(levels,)`, which
            add up to `n`.
        n: The number of runs.
        rng: Generator of random numbers, from which the hypercube is drawn.
    """
    unit = unit_lhs(n, len(counts), rng)
    ranks = unit.argsort(axis=0).argsort(axis=0)
    columns = [
        np.repeat(np.arange(len(shares)), shares)[ranks[:, axis]]
        for axis, shares in enumerate(counts)
    ]
    return np.stack(columns, axis=1)


def repair_level_shares(treatments: Ids, pool: Ids, levels: Ids, counts: Sequence[Ids]) -> Ids:
    """Different treatments of a pool: those of `treatments`, with others in place of repeats and of
    those outside of the pool.

    The others are those of the pool whose levels are missing most.

    Parameters:
        treatments: Numbers of the treatments, of shape `(n,)`: rows of `levels`.
        pool: Numbers of the treatments that may be taken, of shape `(k,)`.
        levels: All treatments of the space, of shape `(size, axes)`.
        counts: For each axis, the number of runs that each level should have, of shape `(levels,)`.

    Returns:
        Numbers of the treatments, of shape `(n,)`.
    """
    kept = np.intersect1d(treatments, pool)
    for _ in range(len(treatments) - len(kept)):
        free = np.setdiff1d(pool, kept)
        missing = [
            (level_counts - np.bincount(levels[kept, axis], minlength=len(level_counts)))[
                levels[free, axis]
            ]
            for axis, level_counts in enumerate(counts)
        ]
        kept = np.append(kept, free[np.minimum(missing, 1).sum(axis=0).argmax()])
    return np.asarray(kept)


#: Ways to share out the values that are drawn, of which the most even is kept.
_DRAWS = 20


def assign_values(space: Space, strata: Ids, recorded: Ids, rng: np.random.Generator) -> Ids:
    """Treatments `(n, axes)` of a space from those of `space.stratified`.

    The runs in one part of a range have values at equal distances in it, so that the whole column
    is a Latin hypercube as far as the factor's steps are fine enough. Which run gets which value is
    the best of several draws: fewest repeated treatments first, then the least centred discrepancy.

    Parameters:
        space: What the campaign varies.
        strata: The balanced treatments, of shape `(n, axes)`, with a part of the range in place of
            the value of each continuous factor.
        recorded: Treatments of the space that are there already, of shape `(k, axes)`.
        rng: Generator of random numbers, which gives the values to runs.
    """
    drawn = [_drawn_levels(space, strata, rng) for _ in range(_DRAWS)]
    return min(drawn, key=lambda rows: _unevenness(space, np.vstack([recorded, rows])))


def _unevenness(space: Space, rows: Ids) -> tuple[int, float]:
    return len(rows) - len(np.unique(rows, axis=0)), discrepancy(centres(space, rows), "CD")


def _drawn_levels(space: Space, strata: Ids, rng: np.random.Generator) -> Ids:
    rows = strata.copy()
    for index, axis in enumerate(space.axes):
        if axis.continuous:
            for stratum in range(axis.strata):
                members = np.flatnonzero(strata[:, index] == stratum)
                rows[members, index] = rng.permutation(_values(axis, stratum, len(members)))
    return rows


def _values(axis: Axis, stratum: int, count: int) -> Ids:
    """(count,): indices of values at equal distances in a part of a range."""
    first, after = (-(-edge * axis.size // axis.strata) for edge in (stratum, stratum + 1))
    return first + np.floor((np.arange(count) + 0.5) / max(count, 1) * (after - first)).astype(
        np.int64
    )


#: A table of all treatments by all is kept up to here (32 MB).
MOST_TABULATED = 2000
#: Steps for each swap of one level of one run, and no more than some seconds' worth; a step looks
#: at a run's swaps.
_STEPS_PER_SWAP, _MOST_STEPS, _MOST_SWAPS = 90, 50_000, 60_000_000
_MOST_STARTS = 5
#: Steps are some hundred times dearer where nothing is tabulated.
_MOST_DIRECT_STEPS = 1500
#: For a treatment that must not be taken (again).
_FORBIDDEN = 50.0


@dataclass(frozen=True)
class _Task:
    """`n` different treatments of `pool` (k,) are wanted beside those that `counts` (size,) says
    are there."""

    space: Space
    n: int
    pool: Ids
    counts: Floats
    runs: int  #: of the whole design
    weights: Weights
    steps: int | None

    @property
    def sizes(self) -> tuple[int, ...]:
        return tuple(axis.size for axis in self.space.axes)


def balance_levels(
    space: Space,
    n: int,
    rng: np.random.Generator,
    *,
    fixed: Ids | None = None,
    weights: Weights | None = None,
    steps: int | None = None,
) -> Design:
    """`n` treatments that are balanced together with those that are there already. Only the `n` are
    given back.

    No treatment is taken again while new ones remain. Level counts are within one of their share
    where `fixed` allows; pairs and triples are as near to theirs as annealing brings them. The runs
    stand in no particular order; the design's seed, which only the caller knows, is None.

    Parameters:
        space: What the campaign varies.
        n: The number of treatments that are chosen.
        rng: Generator of random numbers; in the same state it gives the same treatments.
        fixed: Treatments that are there already, of shape `(k, axes)`; by default there are none.
        weights: How much pairs, triples, repeats and discrepancies count; by default as `Weights`
            has them.
        steps: The number of steps of annealing; by default as many as take some seconds.

    Raises:
        ValueError: For `n` or `steps` below 1, for rows of `fixed` that are no treatments, and in
            spaces of more than `MOST_TABULATED` treatments for runs that take more than half of
            them.
    """
    for name, value in (("n", n), ("steps", 1 if steps is None else steps)):
        if value < 1:
            raise ValueError(f"{name} is {value!r}; expected at least 1")
    recorded = space.checked(
        np.zeros((0, len(space.axes)), dtype=np.int64) if fixed is None else fixed
    )
    weights = weights or Weights()
    if space.stratified is not space:
        parts = balance_levels(
            space.stratified, n, rng, fixed=space.in_strata(recorded), weights=weights, steps=steps
        )
        return Design(space, assign_values(space, parts.treatments, recorded, rng), "lhs", None)
    if space.size > MOST_TABULATED:
        chosen = _choose_directly(space, n, recorded, weights, steps, rng)
    else:
        chosen = _choose(space, n, recorded, weights, steps, rng)
    return Design(space, rng.permutation(chosen), "lhs", None)


def _choose(
    space: Space,
    n: int,
    recorded: Ids,
    weights: Weights,
    steps: int | None,
    rng: np.random.Generator,
) -> Ids:
    """What is there least often is taken first: whole rounds of it, and a chosen part of the last
    round."""
    levels = space.all_treatments()
    counts = np.bincount(_numbers(space, recorded), minlength=space.size).astype(np.float64)
    runs, taken = n + len(recorded), []
    while True:
        pool = np.flatnonzero(counts == counts.min())
        if len(pool) > n:
            break
        taken.append(pool)
        counts[pool] += 1
        n -= len(pool)
    if n:
        task = _Task(space, n, pool, counts, runs, weights, steps)
        taken.append(
            _optimised(task, levels, 1.0, rng)
            if 2 * n <= len(pool)
            else _all_but(task, levels, rng)
        )
    return levels[np.concatenate(taken)]


def _all_but(task: _Task, levels: Ids, rng: np.random.Generator) -> Ids:
    """Near a full factorial hardly a swap is free: those to leave out are chosen instead."""
    everything = task.counts.copy()
    everything[task.pool] += 1
    left_out = _optimised(
        replace(task, n=len(task.pool) - task.n, counts=everything), levels, -1.0, rng
    )
    return np.setdiff1d(task.pool, left_out)


def _optimised(task: _Task, levels: Ids, sign: float, rng: np.random.Generator) -> Ids:
    """Numbers of different treatments that, added to the counts (sign 1) or taken away (-1),
    balance the whole."""
    penalty = np.full(task.space.size, _FORBIDDEN)
    penalty[task.pool] = 0.0
    kernel = Kernel(axis_centres(task.space), task.runs, task.weights)
    landscape = TabulatedCriterion(kernel, levels, task.counts, sign, penalty)
    return min(
        (_started(task, levels, sign, landscape, rng) for _ in range(_starts(task))),
        key=landscape.height,
    )


def _started(
    task: _Task, levels: Ids, sign: float, landscape: TabulatedCriterion, rng: np.random.Generator
) -> Ids:
    """One shares-out of the levels, annealed; which levels get one more is left to chance."""
    shares = [
        level_counts(
            sign * np.bincount(levels[:, axis], task.counts, size).astype(np.float64),
            np.bincount(levels[task.pool, axis], minlength=size),
            task.n,
            rng,
        )
        for axis, size in enumerate(task.sizes)
    ]
    start = draw_hypercube(shares, task.n, rng)
    steps = task.steps or _steps(start.size, _MOST_STEPS)
    annealed = anneal_tabulated(landscape, start, task.sizes, steps, rng)
    return repair_level_shares(_numbers(task.space, annealed), task.pool, levels, shares)


def _starts(task: _Task) -> int:
    """Few runs leave time for more than one start, and beside recorded ones it matters which levels
    get one more."""
    return (
        1
        if task.steps
        else max(1, min(_MOST_STARTS, _MOST_STEPS // _steps(task.n * len(task.sizes), _MOST_STEPS)))
    )


def _choose_directly(
    space: Space,
    n: int,
    recorded: Ids,
    weights: Weights,
    steps: int | None,
    rng: np.random.Generator,
) -> Ids:
    """The same in a space too large for a table of all treatments, where new ones never run out."""
    sizes = tuple(axis.size for axis in space.axes)
    if 2 * (n + len(recorded)) > space.size:
        raise ValueError(
            f"{n + len(recorded)} runs of {space.size} treatments; expected half of them at most"
        )
    already = [
        np.bincount(recorded[:, axis], minlength=size).astype(np.float64)
        for axis, size in enumerate(sizes)
    ]
    shares = [level_counts(counts, np.full(len(counts), n), n, rng) for counts in already]
    start = draw_hypercube(shares, n, rng)
    kernel = Kernel(axis_centres(space), n + len(recorded), weights)
    surface = DirectCriterion(kernel, sizes, _numbers(space, start), _numbers(space, recorded))
    annealed = anneal(surface, start, sizes, steps or _steps(start.size, _MOST_DIRECT_STEPS), rng)
    return _different(annealed, recorded, sizes, rng)


def _different(
    treatments: Ids, recorded: Ids, sizes: tuple[int, ...], rng: np.random.Generator
) -> Ids:
    """Repeats, which annealing hardly leaves, give way to treatments drawn at random."""
    seen, result = set(map(tuple, recorded.tolist())), []
    for run in map(tuple, treatments.tolist()):
        while run in seen:
            run = tuple(rng.integers(sizes).tolist())
        seen.add(run)
        result.append(run)
    return np.array(result, dtype=np.int64)


def _numbers(space: Space, treatments: Ids) -> Ids:
    """(n,): the flat index of each treatment (n, axes)."""
    sizes = tuple(axis.size for axis in space.axes)
    return np.asarray(np.ravel_multi_index(tuple(treatments.T), sizes), dtype=np.int64)


def _steps(swaps: int, most: int) -> int:
    """In proportion to the swaps that a run has; fewer where each step looks at very many."""
    return max(1, min(_STEPS_PER_SWAP * swaps, most, _MOST_SWAPS // swaps))
