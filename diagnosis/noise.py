"""What repetitions say of the scatter of one run, drawn towards the sensors' data sheets where they are few."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from .stages.base import Observable

Floats = NDArray[np.float64]

#: The data sheet weighs as much as so many degrees of freedom. Few: a bench scatters more than its sensors, and a
#: scatter that is taken too small accuses.
SHEET_WEIGHT = 3.0
#: Correlations are drawn towards none as if so many runs for each observable had shown none.
PLAIN_WEIGHT = 1.0


@dataclass(frozen=True, eq=False)
class Noise:
    """Scatter of one run: covariance (D, D), and the degrees of freedom (D,) that measured it; 0: floor assumed."""

    covariance: Floats
    freedom: Floats

    @property
    def assumed(self) -> bool:
        """Whether no repetition measured it."""
        return not bool((self.freedom > 0).any())

    @classmethod
    def of(cls, deviations: Floats, configuration: NDArray[np.intp], observables: Sequence[Observable]) -> Self:
        """From deviations (R, D) of runs from the mean of their configuration, NaN where there is none.

        Variances: (nu s^2 + nu0 f^2) / (nu + nu0) with f of the data sheets. Correlations pooled over observables that
        a run has both of, times nu / (nu + D): shrinkage towards none in the manner of Ledoit and Wolf (2004), with a
        weight that is fixed since the optimal one is itself uncertain with few runs.
        """
        known = np.isfinite(deviations)
        values = np.where(known, deviations, 0.0)
        groups = [np.any(known[configuration == c], axis=0) for c in np.unique(configuration)]
        freedom = known.sum(axis=0) - np.sum(groups, axis=0)
        sheet = np.array([item.floor for item in observables]) ** 2
        squares = (values**2).sum(axis=0)
        variance = (squares + SHEET_WEIGHT * sheet) / (freedom + SHEET_WEIGHT)
        norm = np.sqrt(squares)
        with np.errstate(invalid="ignore", divide="ignore"):
            correlation = np.nan_to_num((values.T @ values) / np.outer(norm, norm))
        typical = float(np.median(freedom))
        correlation *= typical / (typical + PLAIN_WEIGHT * len(observables)) if typical > 0 else 0.0
        np.fill_diagonal(correlation, 1.0)
        sigma = np.sqrt(variance)
        return cls(correlation * np.outer(sigma, sigma), freedom.astype(np.float64))
