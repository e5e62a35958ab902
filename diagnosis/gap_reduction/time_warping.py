"""Dynamic time warping in a band, compiled."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ..localisation.means import Floats


@njit(cache=True)
def warped(x: Floats, y: Floats, window: int) -> NDArray[np.int64]:
    """(k, 2): pairs of samples of x and y on the path of the least sum of squared differences.

    Steps of one sample in x, in y or in both, all of one weight, and at most `window` samples apart (Sakoe and Chiba,
    IEEE Trans. ASSP 26 (1978) 43).
    """
    n, m = len(x), len(y)
    cost = np.full((n + 1, m + 1), np.inf)
    cost[0, 0] = 0.0
    for i in range(1, n + 1):
        for j in range(max(1, i - window), min(m, i + window) + 1):
            least = min(cost[i - 1, j - 1], cost[i - 1, j], cost[i, j - 1])
            cost[i, j] = (x[i - 1] - y[j - 1]) ** 2 + least
    path = np.empty((n + m, 2), dtype=np.int64)
    i, j, length = n, m, 0
    while i > 0 and j > 0:
        path[length, 0], path[length, 1] = i - 1, j - 1
        length += 1
        above, left, both = cost[i - 1, j], cost[i, j - 1], cost[i - 1, j - 1]
        if both <= above and both <= left:
            i, j = i - 1, j - 1
        elif above <= left:
            i -= 1
        else:
            j -= 1
    return path[:length][::-1]
