"""Runs that a design gets beside its own: copies of the whole design, and points in the middle of
the ranges."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from .base import Design


def replicated(design: Design, replicates: int) -> Design:
    """The design `replicates` times over: every copy is set up anew, so that the scatter between
    set-ups is seen.

    Raises `ValueError` for less than one.
    """
    if replicates < 1:
        raise ValueError(f"replicates is {replicates}; expected 1 or more")
    if replicates == 1:
        return design
    return replace(
        design,
        treatments=np.tile(design.treatments, (replicates, 1)),
        method=f"{design.method} replicates={replicates}",
    )


def with_centre_points(design: Design, points: int, rng: np.random.Generator) -> Design:
    """The design with `points` runs in the middle of every ordered and continuous factor
    (Montgomery, section 6.8).

    They show a curved response, and the scatter between set-ups. Factors of words have no middle:
    their levels take turns in random order, as evenly as can be. An even number of levels has the
    lower of the two in the middle. Raises `ValueError` for less than none, and where no factor has
    an order.
    """
    if points < 0:
        raise ValueError(f"centre points are {points}; expected 0 or more")
    if points == 0:
        return design
    axes = design.space.axes
    if not any(axis.ordered for axis in axes):
        raise ValueError(
            f"factors {design.space.name!r} have no ordered factor, so that "
            f"there is no centre; leave out centre points"
        )
    columns: list[NDArray[np.int64]] = [
        np.full(points, (axis.size - 1) // 2) if axis.ordered else _turns(axis.size, points, rng)
        for axis in axes
    ]
    centre = np.stack(columns, axis=1).astype(np.int64)
    return replace(
        design,
        treatments=np.concatenate([design.treatments, centre]),
        method=f"{design.method} centre_points={points}",
    )


def _turns(levels: int, points: int, rng: np.random.Generator) -> NDArray[np.int64]:
    rounds = [rng.permutation(levels) for _ in range(-(-points // levels))]
    return np.concatenate(rounds)[:points]
