"""Means over pulses whose repetitions belong together: what the bootstrap and the permutation test share."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats

#: Of the intervals that are told.
COVERAGE = 0.90


@dataclass(frozen=True, eq=False)
class Clusters:
    """Pulses summed by cluster: `sums` (k x m) of m quantities, `sizes` (k,) in pulses."""

    sums: Floats
    sizes: Floats

    def __len__(self) -> int:
        return len(self.sizes)

    @property
    def mean(self) -> Floats:
        """Mean over all pulses, (m,)."""
        mean: Floats = self.sums.sum(axis=0) / self.sizes.sum()
        return mean


def clustered(values: Floats, labels: NDArray[Any]) -> Clusters:
    """Values (n x m) by labels (n,). Raises `ValueError` where their lengths differ or nothing is given."""
    if len(values) != len(labels) or len(labels) == 0:
        raise ValueError(f"{len(values)} values and {len(labels)} labels: give one label a pulse, and at least one")
    names, member = np.unique(labels, return_inverse=True)
    sums = np.zeros((len(names), values.shape[1]))
    np.add.at(sums, member, values)
    return Clusters(sums, np.bincount(member).astype(np.float64))


def bootstrap_interval(clusters: Clusters, rng: np.random.Generator, resamples: int) -> tuple[Floats, Floats]:
    """Low and high (m,) of the 90 % interval of the mean, from whole clusters drawn with replacement.

    Percentiles (Davison and Hinkley, Bootstrap Methods and their Application, 1997, chapter 5), widened about the mean
    by sqrt(k / (k - 1)): the variance of k drawn clusters is (k - 1) / k of what it should be. NaN for one cluster.
    """
    k, mean = len(clusters), clusters.mean
    if k < 2:
        return np.full_like(mean, np.nan), np.full_like(mean, np.nan)
    drawn = rng.multinomial(k, np.full(k, 1.0 / k), size=resamples).astype(np.float64)
    means = (drawn @ clusters.sums) / (drawn @ clusters.sizes)[:, None]
    tail = (1 - COVERAGE) / 2
    low, high = np.quantile(means, [tail, 1 - tail], axis=0)
    wider = np.sqrt(k / (k - 1))
    return mean + wider * (low - mean), mean + wider * (high - mean)
