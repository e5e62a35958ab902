"""Mean gaps of one stage over the configurations, and the scores by which regions are looked for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from ..observables.base import Observable
from .means import Floats, Means, floors, tolerances

_DIRECTIONS = 1


@dataclass(frozen=True, eq=False)
class StageGaps:
    """Configurations that have a gap, `kept` (C,) of the record. Gaps (C, d) in tolerances and in floors.

    `noise` (C, d) is the variance of the former; `scores` (C, q) are what rules split.
    """

    tolerances: Floats
    floors: Floats
    noise: Floats
    scores: Floats
    kept: NDArray[np.intp]

    @classmethod
    def of(
        cls, residual: Floats, configuration: NDArray[np.intp], configurations: int, observables: Sequence[Observable]
    ) -> Self:
        """From residuals (R, d) of runs."""
        means = Means.of(residual, configuration, configurations, floors(observables))
        kept = np.flatnonzero(np.isfinite(means.mean).any(axis=1))
        gap, noise = means.mean[kept] / tolerances(observables), means.variance[kept] / tolerances(observables) ** 2
        # Half a tolerance is the noise of a simulator: else one observable that scatters little would be all there is.
        white = np.nan_to_num(gap / np.sqrt(noise + 0.25))
        return cls(gap, gap / np.sqrt(np.maximum(noise, 1e-12)), noise, _scores(white), kept)

    def rms(self, inside: NDArray[np.bool_]) -> float:
        """In tolerances, the scatter of the repetitions taken off; 0 where there is nothing."""
        square = (self.tolerances[inside] ** 2 - self.noise[inside])[np.isfinite(self.tolerances[inside])]
        return float(np.sqrt(max(0.0, float(square.mean())))) if square.size else 0.0

    @property
    def size(self) -> float:
        """`rms` of all."""
        return self.rms(np.ones(len(self.kept), dtype=bool))

    def excess(self, inside: NDArray[np.bool_]) -> float:
        """Rms gap inside less that outside, in floors."""
        squares = [float(np.nanmean(self.floors[part] ** 2)) - 1 for part in (inside, ~inside)]
        within, outside = np.sqrt(np.maximum(squares, 0.0))
        return float(within - outside)


def _scores(white: Floats) -> Floats:
    """(C, q): along the main direction, and in size; both logarithmic where they are large."""
    if not white.size:
        return np.empty((len(white), 0))
    signed = np.arcsinh(white @ np.linalg.svd(white, full_matrices=False)[2][:_DIRECTIONS].T)
    size = np.log(np.mean(white**2, axis=1, keepdims=True) + 0.25)
    return np.concatenate([signed, size], axis=1)
