"""Means over the runs of a configuration, and what their scatter leaves of them: what all of this room starts from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from ..observables.base import Observable

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Means:
    """C configurations by d observables. `mean` and `variance` of that mean (C, d), NaN where no run has a value.

    `scatter` (d,): standard deviation of one run.
    """

    mean: Floats
    variance: Floats
    scatter: Floats

    @classmethod
    def of(
        cls, values: Floats, configuration: NDArray[np.intp], configurations: int, floor: Floats | float = 0.0
    ) -> Self:
        """From runs (R, d), NaN allowed. The scatter is pooled over configurations; without repetitions: `floor`."""
        known = np.isfinite(values)
        count = _summed(known.astype(np.float64), configuration, configurations)
        with np.errstate(invalid="ignore", divide="ignore"):
            mean = np.where(
                count > 0, _summed(np.where(known, values, 0.0), configuration, configurations) / count, np.nan
            )
            away = np.where(known, values - mean[configuration], 0.0)
            freedom = np.maximum(count - 1, 0).sum(axis=0)
            scatter = np.where(freedom > 0, np.sqrt((away**2).sum(axis=0) / np.maximum(freedom, 1)), floor)
            variance = np.where(count > 0, scatter**2 / count, np.nan)
        return cls(mean, variance, np.asarray(scatter, dtype=np.float64))


def _summed(values: Floats, configuration: NDArray[np.intp], configurations: int) -> Floats:
    total = np.zeros((configurations, values.shape[1]))
    np.add.at(total, configuration, values)
    return total


def tolerances(observables: Sequence[Observable]) -> Floats:
    """(d,)"""
    return np.array([item.tolerance for item in observables], dtype=np.float64)


def floors(observables: Sequence[Observable]) -> Floats:
    """(d,): what the data sheets say of one run."""
    return np.array([item.floor for item in observables], dtype=np.float64)
