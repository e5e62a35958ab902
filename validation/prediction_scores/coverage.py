"""The share of measured values inside of a band, with an interval that knows that repetitions resemble each other."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from ...training.metrics.clusters import clustered

#: The share of intervals that miss.
_ERROR = 0.05


@dataclass(frozen=True)
class Coverage:
    """`share` of `values` measured values inside of a band. `effective` is the number of independent values that the
    share is as well known from; values of one configuration (repetitions, and lines of one spectrum) count as less
    than as many.
    """

    share: float
    values: int
    configurations: int
    effective: float

    @classmethod
    def of(cls, inside: NDArray[np.bool_], configuration: NDArray[np.intp]) -> Self:
        """Of values (n,) that lie inside or not, and the configuration (n,) of each. Raises `ValueError` for none."""
        groups = clustered(inside.astype(np.float64)[:, None], configuration)
        share = float(groups.mean[0])
        effective = _effective_number(groups.sums[:, 0] - share * groups.sizes, share, len(inside))
        return cls(share, len(inside), len(groups), effective)

    def interval(self, comparisons: int = 1) -> tuple[float, float]:
        """The 95 % interval of the share, exact for the binomial law of the effective number of values (Clopper and
        Pearson, Biometrika 26 (1934) 404; for clusters Korn and Graubard); so many `comparisons` share the 5 % of
        errors (Bonferroni).
        """
        from scipy.special import betaincinv

        hits, tail = self.share * self.effective, _ERROR / (2 * comparisons)
        misses = self.effective - hits
        low = float(betaincinv(hits, misses + 1, tail)) if hits > 0 else 0.0
        return low, float(betaincinv(hits + 1, misses, 1 - tail)) if misses > 1e-9 else 1.0


def _effective_number(deviations: NDArray[np.float64], share: float, values: int) -> float:
    """How many independent values give a share of the same variance as k configurations do (Korn and Graubard,
    Survey Methodology 24 (1998) 193): p (1 - p) over k / (k - 1) times the sum of their squared `deviations` over n^2.

    Never more than the values. Where all are inside, or none is, nothing can be said of how alike repetitions are:
    then a configuration counts as a single value.
    """
    k = len(deviations)
    variance = k / (k - 1) * float(deviations @ deviations) / values**2 if k > 1 else 0.0
    if variance <= 0:
        return float(k)
    return min(float(values), share * (1 - share) / variance)
