"""Further runs for a campaign that went otherwise than planned: what was lost is made good by what
balances best."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..space import Space
from .base import Design

#: Space, number of further treatments, and the recorded ones (k, axes), which stay as they are.
Choose = Callable[[Space, int, NDArray[np.int64]], Design]


def augment(space: Space, recorded: NDArray[np.int64], n: int, choose: Choose) -> Design:
    """Further treatments beside those that are there already.

    Failed and discarded runs are not recorded: leave them out of `recorded`, count them in `n`, and
    they are replaced by the treatments that serve the whole best, which need not be the lost ones.

    Parameters:
        space: What the campaign varies.
        recorded: Treatments that are really recorded, of shape `(k, axes)`; k may be 0. They stay
            as they are.
        n: The number of further treatments, at least 1.
        choose: A function of the space, `n` and the recorded treatments that gives the design; it
            carries the randomness. It must give `n` treatments of this space, and none that is
            there already while new ones remain.

    Raises:
        ValueError: For `n` below 1, for recorded rows that are no treatments, and where `choose`
            does not give such a design.
    """
    if n < 1:
        raise ValueError(f"n is {n!r}; expected at least 1 further treatment")
    fixed = space.checked(recorded)
    chosen = choose(space, n, fixed.copy())
    if chosen.space != space or len(chosen.treatments) != n:
        raise ValueError(
            f"{len(chosen.treatments)} treatments of space {chosen.space.name!r} were chosen; "
            f"expected {n} of {space.name!r}"
        )
    before, after = _distinct(fixed), _distinct(np.vstack([fixed, chosen.treatments]))
    expected = min(n, space.size - before)
    if after - before < expected:
        raise ValueError(f"{after - before} of the chosen treatments are new; expected {expected}")
    return replace(chosen, method="augment")


def _distinct(treatments: NDArray[np.int64]) -> int:
    return len(np.unique(treatments, axis=0)) if treatments.size else 0
