"""The order of runs: what is hard to change stays as long as it can, everything else is left to
chance.

Random order spreads drift over all effects (Montgomery, section 1.3), but a plate weighs too much
to be changed at random (thesis, appendix A). The plan becomes a split plot: the hard factors are
the whole plots, and their effects are confounded with time as far as `time_confounding` says.
Blocks visit every set-up more than once, which costs some changeovers and takes a steady drift out
of the effects of the hard factors.

How often the bench is rebuilt when runs follow each other, factor by factor.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from ..array_types import Levels
from .space import Axis, Space


def factor_levels(axis: Axis) -> NDArray[np.int64]:
    """The level of each factor of an axis, of shape `(combinations, factors)`.

    Parameters:
        axis: An axis of a space, of one factor or of several that depend on each other.
    """
    return np.array(axis.combinations, dtype=np.int64).reshape(axis.size, len(axis.factors))


def changeovers(space: Space, treatments: NDArray[np.int64]) -> dict[str, int]:
    """Factor to the number of times that it differs from the run before.

    Parameters:
        space: What the campaign varies.
        treatments: Treatments of the space, of shape `(n, axes)`, in order of run.
    """
    changes_by_factor: dict[str, int] = {}
    for index, axis in enumerate(space.axes):
        changed = np.diff(factor_levels(axis)[treatments[:, index]], axis=0) != 0
        changes_by_factor |= {
            factor.name: int(changed[:, place].sum()) for place, factor in enumerate(axis.factors)
        }
    return {factor.name: changes_by_factor[factor.name] for factor in space.factors}


Costs = dict[int, dict[int, int]]

#: All paths are tried up to here, 720 of them; beyond, the nearest next one is taken.
_MOST_TRIED = 6
#: Orders drawn, of which the one with the fewest changeovers is kept.
_DRAWS = 12


RunOrder = Literal["split-plot", "random"]


def run_order(
    space: Space,
    treatments: Levels,
    rng: np.random.Generator,
    kind: RunOrder = "split-plot",
    blocks: int = 1,
) -> Levels:
    """The run order of treatments: indices `(n,)`, such that `treatments[indices]` is fired from
    first to last.

    In a split plot, axes with a `change` above 0 stay together, the hardest outermost: each of
    their combinations is one block, and blocks follow each other with few changes, those of the
    hardest factors counted first. A block begins where the one before ended, so that the second
    plate meets the anvils in reverse, which balances a steady drift. Within a block the runs are in
    random order.

    Parameters:
        space: What the campaign varies.
        treatments: Treatments of the space, of shape `(n, axes)`, in any order.
        rng: Generator of random numbers, from which the order of runs within a block is drawn, and
            that of set-ups that cost the same.
        kind: "split-plot", which is the default, or "random": full randomisation, whatever the
            work.
        blocks: The number of parts into which the runs are cut, each with the same share of every
            hard combination; 1 by default. Each part is a split plot of its own and begins where
            the one before ended: with two, plates come as A B B A.

    Raises:
        ValueError: For rows that are no treatments, an unknown kind, less than one block, more
            blocks than runs, and blocks in random order.
    """
    rows = space.checked(treatments)
    _check_order(kind, blocks, len(rows))
    if kind == "random":
        return rng.permutation(len(rows))
    weights = _weights(space, len(rows))
    hard = [index for index, axis in enumerate(space.axes) if axis.change > 0]
    hard.sort(key=lambda index: -space.axes[index].change)
    paths = [
        (index, _costs(space.axes[index], np.unique(rows[:, index]), weights)) for index in hard
    ]
    drawn = [_blocked(rows, paths, blocks, rng) for _ in range(_DRAWS if hard else 1)]
    return min(drawn, key=lambda indices: _work(space, rows[indices], weights))


def _check_order(kind: str, blocks: int, runs: int) -> None:
    if kind not in get_args(RunOrder):
        raise ValueError(f"order is {kind!r}; expected one of {', '.join(get_args(RunOrder))}")
    if not 1 <= blocks <= max(1, runs):
        raise ValueError(f"blocks is {blocks}; expected 1 to {max(1, runs)}, the number of runs")
    if kind == "random" and blocks > 1:
        raise ValueError(
            f"blocks is {blocks}, but the order is random; expected the order "
            f"split-plot with blocks"
        )


def _blocked(
    rows: Levels, paths: Sequence[tuple[int, Costs]], blocks: int, rng: np.random.Generator
) -> Levels:
    """Block after block, each as `_nested`, with what the block before left on the bench."""
    at: dict[int, int] = {}
    parts = [
        _nested(rows, part, paths, at, rng)
        for part in _even_parts(rows, [axis for axis, _ in paths], blocks, rng)
    ]
    return np.concatenate(parts)


def _even_parts(
    rows: Levels, hard: Sequence[int], blocks: int, rng: np.random.Generator
) -> list[Levels]:
    """Indices of the rows in `blocks` parts, the runs of each combination of the hard axes dealt
    out in turn."""
    if blocks == 1:
        return [np.arange(len(rows))]
    shuffled = rng.permutation(len(rows))
    dealt = (
        shuffled[np.lexsort(tuple(rows[shuffled, axis] for axis in reversed(hard)))]
        if hard
        else shuffled
    )
    return [np.sort(dealt[part::blocks]) for part in range(blocks)]


def time_confounding(space: Space, ordered: Levels) -> dict[str, float]:
    """Axis to its correlation ratio (eta squared) with time.

    It is the share of the variance of the run's position that the axis's levels explain: 1 would be
    all of it. In random order k levels have (k - 1) / (n - 1) on average. A linear drift disturbs
    an axis's effects by that share. A continuous factor is taken by the parts of its range.

    Parameters:
        space: What the campaign varies.
        ordered: Treatments of the space, of shape `(n, axes)`, in order of run.

    Raises:
        ValueError: For rows that are no treatments.
    """
    rows = space.in_strata(ordered)
    return {axis.name: _correlation_ratio(rows[:, index]) for index, axis in enumerate(space.axes)}


def _correlation_ratio(levels: Levels) -> float:
    position = np.arange(len(levels)) - (len(levels) - 1) / 2
    counts = np.bincount(levels)
    sums = np.bincount(levels, position)
    between = float((sums[counts > 0] ** 2 / counts[counts > 0]).sum())
    return between / float(position @ position) if len(levels) > 1 else 0.0


def _weights(space: Space, runs: int) -> dict[str, int]:
    """Cost of a change of each factor: one of a harder factor outweighs all changes of easier
    ones."""
    ranks = sorted({factor.change for factor in space.factors} | {0})
    base = runs * len(space.factors) + 1
    return {
        factor.name: base ** ranks.index(factor.change) if factor.change else 0
        for factor in space.factors
    }


def _work(space: Space, rows: Levels, weights: dict[str, int]) -> int:
    return sum(weights[name] * count for name, count in changeovers(space, rows).items())


def _costs(axis: Axis, used: Levels, weights: dict[str, int]) -> Costs:
    """Of going from one combination in use to another."""
    levels = {index: axis.combinations[index] for index in used.tolist()}
    work = [weights[factor.name] for factor in axis.factors]
    return {
        here: {
            there: sum(w for w, x, y in zip(work, a, b, strict=True) if x != y)
            for there, b in levels.items()
        }
        for here, a in levels.items()
    }


def _nested(
    rows: Levels,
    indices: Levels,
    paths: Sequence[tuple[int, Costs]],
    at: dict[int, int],
    rng: np.random.Generator,
) -> Levels:
    """Blocks of the first axis, in each of them blocks of the next; `at` is where each axis was
    left."""
    if not paths or not len(indices):
        return rng.permutation(indices)
    (axis, costs), inner = paths[0], paths[1:]
    parts = []
    for level in _path(np.unique(rows[indices, axis]).tolist(), costs, at.get(axis), rng):
        at[axis] = level
        parts.append(_nested(rows, indices[rows[indices, axis] == level], inner, at, rng))
    return np.concatenate(parts)


def _path(
    levels: list[int], costs: Costs, start: int | None, rng: np.random.Generator
) -> list[int]:
    """A cheapest order of the levels, coming from `start`; chance decides between equals."""
    shuffled = [int(level) for level in rng.permutation(levels)]
    if len(levels) > _MOST_TRIED:
        return _nearest(shuffled, costs, start)

    def cost(path: Iterable[int]) -> int:
        steps = itertools.pairwise(path if start is None else (start, *path))
        return sum(costs[a][b] for a, b in steps)

    return list(min(itertools.permutations(shuffled), key=cost))


def _nearest(shuffled: list[int], costs: Costs, start: int | None) -> list[int]:
    remaining, path, here = list(shuffled), [], start
    while remaining:
        following = remaining[0] if here is None else min(remaining, key=costs[here].__getitem__)
        remaining.remove(following)
        path.append(following)
        here = following
    return path
