"""How far one quantity rises with another: Spearman's rank correlation with its interval."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ....array_types import Floats

#: Of the standard normal distribution, for an interval of 95 %.
_QUANTILE = 1.959964
#: The interval needs more independent rows than these.
_FEWEST = 4


@dataclass(frozen=True)
class RankCorrelation:
    """`coefficient` from -1 to 1 of `rows`, and the ends of its 95 % interval, which rests on
    `independent` rows; NaN where there are too few, or one of the quantities does not vary."""

    coefficient: float
    low: float
    high: float
    rows: int
    independent: int

    @property
    def is_established(self) -> bool:
        """Whether the interval leaves out zero."""
        return self.low > 0 or self.high < 0


def average_ranks(values: Floats) -> Floats:
    """The ranks of values (n,) from 1 on; equal values share the mean of their ranks."""
    _, place, counts = np.unique(values, return_inverse=True, return_counts=True)
    last = np.cumsum(counts)
    means: Floats = (last - (counts - 1) / 2)[place]
    return means


def rank_correlation(x: Floats, y: Floats, independent: int) -> RankCorrelation:
    """Spearman's coefficient of finite x, y (n,).

    The repeated hits of a run are no independent evidence, so that the width of the interval
    follows from the number of runs. It is that of Fisher's transform with the variance
    (1 + r²/2) / (n - 3).

    Parameters:
        x: Values of one quantity (n,).
        y: Values of the other (n,).
        independent: How many of the rows are independent: the number of their runs.

    Source:
        D. G. Bonett, T. A. Wright: Sample size requirements for estimating Pearson, Kendall and
        Spearman correlations, Psychometrika 65 (2000), 23-28.
    """
    nan = math.nan
    if x.size < 2 or np.ptp(x) == 0 or np.ptp(y) == 0:
        return RankCorrelation(nan, nan, nan, x.size, independent)
    coefficient = float(np.corrcoef(average_ranks(x), average_ranks(y))[0, 1])
    coefficient = max(-1.0, min(1.0, coefficient))
    if independent < _FEWEST:
        return RankCorrelation(coefficient, nan, nan, x.size, independent)
    if abs(coefficient) > 1 - 1e-12:
        return RankCorrelation(coefficient, coefficient, coefficient, x.size, independent)
    reach = _QUANTILE * math.sqrt((1 + coefficient**2 / 2) / (independent - 3))
    centre = math.atanh(coefficient)
    low, high = math.tanh(centre - reach), math.tanh(centre + reach)
    return RankCorrelation(coefficient, low, high, x.size, independent)
