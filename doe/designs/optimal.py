"""Designs that are optimal for a stated model, chosen from all feasible treatments by pyDOE3's
exchanges."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..merit.space_filling import main_effects
from ..space import Axis, Space
from . import pydoe
from .base import Design
from .factorial import all_combined, axis_places

#: Every exchange looks at all of them, one by one.
_MOST_CANDIDATES = 5000
_HIGHEST_DEGREE = 4


def optimal(
    space: Space,
    n: int,
    rng: np.random.Generator,
    *,
    criterion: pydoe.OptimalCriterion = "D",
    degree: int = 1,
    exchange: pydoe.Exchange = "detmax",
    levels: int = 3,
) -> Design:
    """`n` different runs for a polynomial of `degree` in the numbers of the factors; words have
    main effects.

    `criterion`: "D" the determinant of the information, "A" the mean variance of the coefficients,
    "I" that of the predictions over all treatments. Candidates are all treatments, with `levels`
    values of each continuous factor; chance decides between equals. Raises `ValueError` for words,
    and for factors of too few levels, in a model beyond degree 1, for more than 5,000 candidates,
    and for fewer runs than the model has terms.
    """
    if not 1 <= degree <= _HIGHEST_DEGREE:
        raise ValueError(
            f"degree is {degree}; expected 1 (main effects), 2 (quadratic), "
            f"at most {_HIGHEST_DEGREE}"
        )
    places = axis_places(space, max(levels, degree + 1))
    count = int(np.prod([len(axis_levels) for axis_levels in places]))
    if not n <= count <= _MOST_CANDIDATES:
        raise ValueError(
            f"{count} candidates; expected {n} (the runs) to {_MOST_CANDIDATES}: other levels"
        )
    treatments = all_combined(places)
    columns = [
        _columns(axis, treatments[:, index], degree)
        for index, axis in enumerate(space.axes)
        if axis.size > 1
    ]
    candidates = np.hstack(columns)
    shuffled = rng.permutation(len(candidates))
    chosen = pydoe.optimal(candidates[shuffled], n, degree, criterion, exchange)
    numbers = {row.tobytes(): index for index, row in enumerate(candidates)}
    return Design(
        space,
        treatments[[numbers[row.tobytes()] for row in np.ascontiguousarray(chosen)]],
        "optimal",
        None,
    )


def _columns(axis: Axis, levels: NDArray[np.int64], degree: int) -> NDArray[np.float64]:
    """The numbers of a factor from -1 to 1, (n, 1); of words a column for each level but one, (n,
    levels - 1)."""
    factor = axis.factors[0]
    numbers = factor.numbers or factor.values
    if len(axis.factors) > 1 or numbers is None:
        if degree > 1:
            raise ValueError(
                f"{axis.name} has words for levels; expected numbers for a model of degree {degree}"
            )
        return main_effects(levels[:, None], [axis.size])[:, 1:]
    if axis.size <= degree:
        raise ValueError(
            f"{axis.name} has {axis.size} levels; expected {degree + 1} for a "
            f"model of degree {degree}"
        )
    values = np.array(numbers)[np.array(axis.combinations)[levels, 0]]
    low, high = min(numbers), max(numbers)
    return np.asarray((2 * values - low - high) / (high - low))[:, None] + 0.0
