"""Every feasible treatment, or a balanced part of them (Montgomery, Design and Analysis of
Experiments, chapter 5)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..space import Space
from . import pydoe
from .base import Design

#: As many as a campaign of years fires.
_MOST_RUNS = 1_000_000
_MOST_LEVELS = 1000


def factorial(space: Space, levels: int = 3) -> Design:
    """All treatments, the last axis fastest: an order to run them in is another function's work.

    Parameters:
        space: What the campaign varies.
        levels: The number of values of each continuous factor, at equal distances, with both ends
            of its range; 3 by default.

    Raises:
        ValueError: For more than a million runs, and for less than two `levels` or more than 1000.
    """
    places = axis_places(space, levels)
    return Design(space, all_combined(places), "factorial", None)


def subset(space: Space, reduction: int = 2, levels: int = 3) -> Design:
    """A part of all treatments in which levels and pairs are balanced: a generalized subset design.

    Factors may have any number of levels, words included.

    Parameters:
        space: What the campaign varies.
        reduction: About one treatment in this number is taken; 2 by default.
        levels: The number of values of each continuous factor, at equal distances, with both ends
            of its range; 3 by default.

    Raises:
        ValueError: Where the reduction is below 2 or too large for the levels, and as `factorial`
            raises it.
    """
    if not 2 <= reduction <= _MOST_LEVELS:
        raise ValueError(f"reduction is {reduction}; expected 2 to {_MOST_LEVELS}")
    places = axis_places(space, levels)
    varied = [index for index, axis_levels in enumerate(places) if len(axis_levels) > 1]
    chosen = pydoe.generalized_subset([len(places[index]) for index in varied], reduction)
    rows = np.zeros((len(chosen), len(places)), dtype=np.int64)
    rows[:, varied] = chosen
    return Design(space, combined(places, rows), "subset", None)


def axis_places(space: Space, levels: int) -> list[NDArray[np.int64]]:
    """Per axis, the indices that a factorial takes: all levels, and some values of a continuous
    factor.

    Parameters:
        space: What the campaign varies.
        levels: The number of values of each continuous factor, at equal distances, with both ends
            of its range.

    Raises:
        ValueError: For fewer than two `levels` or more than 1000, and for more than a million
            combinations.
    """
    if not 2 <= levels <= _MOST_LEVELS:
        raise ValueError(
            f"levels is {levels}; expected 2 to {_MOST_LEVELS} values of each continuous factor"
        )
    places = [
        np.unique(np.rint(np.linspace(0, axis.size - 1, levels)).astype(np.int64))
        if axis.continuous
        else np.arange(axis.size)
        for axis in space.axes
    ]
    runs = float(np.prod([float(len(axis_levels)) for axis_levels in places]))
    if runs > _MOST_RUNS:
        raise ValueError(
            f"space {space.name!r}: {runs:.0f} treatments; expected at most {_MOST_RUNS} to list"
        )
    return places


def all_combined(places: list[NDArray[np.int64]]) -> NDArray[np.int64]:
    """Every combination of the places of the axes as treatments `(n, axes)`, the last axis fastest.

    Parameters:
        places: For each axis, the indices that are combined, of shape `(levels,)`.
    """
    return combined(places, pydoe.full_factorial([len(axis_levels) for axis_levels in places]))


def combined(places: list[NDArray[np.int64]], rows: NDArray[np.int64]) -> NDArray[np.int64]:
    """Treatments `(n, axes)` from indices into the places of each axis.

    Parameters:
        places: For each axis, the indices that are combined, of shape `(levels,)`.
        rows: Indices into `places`, of shape `(n, axes)`.
    """
    return np.stack([axis_levels[rows[:, axis]] for axis, axis_levels in enumerate(places)], axis=1)
