"""Means over the runs of a configuration, and what their scatter leaves of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from ..array_types import Floats, Rows
from .observables.base import Observable


def means(residuals: Floats, configuration: Rows, configurations: int) -> tuple[Floats, NDArray[np.intp]]:
    """Mean over the runs of each configuration (C, D), NaN where there is none, and their number."""
    finite = np.isfinite(residuals)
    total = np.zeros((configurations, residuals.shape[1]))
    count = np.zeros(total.shape, dtype=np.intp)
    np.add.at(total, configuration, np.where(finite, residuals, 0.0))
    np.add.at(count, configuration, finite.astype(np.intp))
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(count > 0, total / count, np.nan), count


@dataclass(frozen=True, eq=False)
class Means:
    """C configurations by d observables. `mean` and `variance` of that mean (C, d), NaN where no run has a value."""

    mean: Floats
    variance: Floats

    @classmethod
    def of(cls, values: Floats, configuration: Rows, configurations: int, floor: Floats | float = 0.0) -> Self:
        """From runs (R, d), NaN allowed. The scatter is pooled over configurations; without repetitions: `floor`."""
        mean, count = means(values, configuration, configurations)
        deviation = np.where(np.isfinite(values), values - mean[configuration], 0.0)
        freedom = np.maximum(count - 1, 0).sum(axis=0)
        scatter = np.where(freedom > 0, np.sqrt((deviation**2).sum(axis=0) / np.maximum(freedom, 1)), floor)
        return cls(mean, np.where(count > 0, scatter**2 / np.maximum(count, 1), np.nan))


def tolerances(observables: Sequence[Observable]) -> Floats:
    """(d,)"""
    return np.array([item.tolerance for item in observables], dtype=np.float64)


def floors(observables: Sequence[Observable]) -> Floats:
    """(d,): what the data sheets say of one run."""
    return np.array([item.floor for item in observables], dtype=np.float64)
