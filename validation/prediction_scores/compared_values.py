"""Measured values beside the draws that predicted them, value by value."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Self

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from ...training.metrics.crps import ensemble_crps

#: Quantiles that are kept of the draws; Hazen's, as the bands of a prediction (`twin.bands`).
_QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)


@dataclass(frozen=True, eq=False)
class ComparedValues:
    """n measured values and what was predicted of them; every array is (n,), all in one unit (logarithm or dB).

    `median` and the ends of the 50 and 90 % bands are of the draws. `rank` is the place of the measured value among
    the draws, from 0 to 1: its probability integral transform. `crps` is its continuous ranked probability score.
    """

    measured: Floats
    median: Floats
    low50: Floats
    high50: Floats
    low90: Floats
    high90: Floats
    rank: Floats
    crps: Floats

    @classmethod
    def of(cls, draws: Floats, measured: Floats) -> Self:
        """From draws (d, n) and measured values (n,). Raises `ValueError` for other shapes and values not finite."""
        crps = ensemble_crps(draws, measured)
        if not (np.isfinite(draws).all() and np.isfinite(measured).all()):
            raise ValueError("draws and measured values must be finite: leave out what was not measured")
        low90, low50, median, high50, high90 = np.quantile(draws, _QUANTILES, axis=0, method="hazen")
        below = (draws < measured).sum(axis=0) + 0.5 * (draws == measured).sum(axis=0)
        # d draws part the line into d + 1 intervals that a further draw hits alike; the middle of one is taken.
        rank = (below + 0.5) / (len(draws) + 1)
        return cls(measured, median, low50, high50, low90, high90, rank, crps)

    @classmethod
    def joined(cls, parts: Sequence[Self]) -> Self:
        """The values of all parts, one part after the other."""
        return cls(*(np.concatenate([getattr(part, item.name) for part in parts]) for item in fields(cls)))

    def __len__(self) -> int:
        return len(self.measured)

    def take(self, rows: NDArray[np.intp] | NDArray[np.bool_]) -> Self:
        """Some of the values, by their rows."""
        return type(self)(*(getattr(self, item.name)[rows] for item in fields(self)))

    @property
    def residual(self) -> Floats:
        """Measured less the median of the prediction."""
        return self.measured - self.median

    @property
    def inside50(self) -> NDArray[np.bool_]:
        return (self.measured >= self.low50) & (self.measured <= self.high50)

    @property
    def inside90(self) -> NDArray[np.bool_]:
        return (self.measured >= self.low90) & (self.measured <= self.high90)

    @property
    def width90(self) -> Floats:
        """Of the 90 % band: the sharpness of the prediction."""
        return self.high90 - self.low90
