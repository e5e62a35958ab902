"""The continuous ranked probability score: how far a predicted distribution lies from the value that was measured."""

from __future__ import annotations

import numpy as np

from ...array_types import Floats


def ensemble_crps(draws: Floats, measured: Floats) -> Floats:
    """Scores (n,) of predictions given as draws (d, n), in the unit of the values; the smaller, the better.

    E|X - y| - E|X - X'| / 2 (Gneiting and Raftery, J. Am. Stat. Assoc. 102 (2007) 359, eq. 21). The second mean is
    taken over pairs of different draws, so that its expectation does not depend on their number (Ferro, Q. J. R.
    Meteorol. Soc. 140 (2014) 1917). A single draw is scored by its absolute error. Raises `ValueError` for arrays of
    other shapes.
    """
    if draws.ndim != 2 or draws.shape[1:] != measured.shape:
        raise ValueError(f"draws are {draws.shape} and measured values {measured.shape}: expected (d, n) and (n,)")
    count = draws.shape[0]
    distance = np.abs(draws - measured).mean(axis=0)
    if count == 1:
        return np.asarray(distance)
    # The sum of |x_i - x_j| over all pairs of sorted draws is that of 2 (2 i - d - 1) x_i.
    weights = (2 * np.arange(1, count + 1) - count - 1) / (count * (count - 1))
    return np.asarray(distance - weights @ np.sort(draws, axis=0))
