"""pyDOE3 behind one door: its maintained successor has the same functions, and only this module would change."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

#: Latin hypercubes that are drawn, of which the one with the largest minimum distance is kept.
_DRAWS = 20


def unit_lhs(n: int, axes: int, rng: np.random.Generator) -> NDArray[np.float64]:
    """pyDOE3's maximin Latin hypercube in the unit cube, (n, axes): one point in each n-th of each axis.

    (McKay, Beckman and Conover, Technometrics 21, 1979; maximin: Johnson, Moore and Ylvisaker, J. Stat. Plan.
    Inference 26, 1990.) Raises `ValueError` for `n` or `axes` below 1.
    """
    if n < 1 or axes < 1:
        raise ValueError(f"n is {n!r} and axes {axes!r}; expected at least 1 of each")
    from pyDOE3 import lhs

    if n == 1:  # no distance to make large
        return np.asarray(lhs(axes, samples=1, seed=rng), dtype=np.float64)
    return np.asarray(lhs(axes, samples=n, criterion="maximin", iterations=_DRAWS, seed=rng), dtype=np.float64)
