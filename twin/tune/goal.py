"""The prescribed spectrum as the tuner works with it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats


@dataclass(frozen=True, eq=False)
class Goal:
    """Levels (f,) in dB re 1 m/s2 at `frequency_hz` (f,), and how far a line may lie above and below, dB (f,) >= 0.

    An infinite tolerance leaves that side free.
    `share` of the lines within tolerance makes a setting good; 1 asks for every line. Raises `ValueError` naming what
    does not fit.
    """

    frequency_hz: Floats
    level_db: Floats
    upper_db: Floats
    lower_db: Floats
    share: float = 1.0

    def __post_init__(self) -> None:
        for name in ("level_db", "upper_db", "lower_db"):
            values = getattr(self, name)
            if values.shape != self.frequency_hz.shape or np.any(np.isnan(values)):
                raise ValueError(f"{name} has shape {values.shape}: expected {self.frequency_hz.shape}, no NaN")
        if not np.all(np.isfinite(self.level_db)):
            raise ValueError("level_db: expected finite levels")
        if np.any(self.upper_db < 0) or np.any(self.lower_db < 0):
            raise ValueError("upper_db, lower_db: expected 0 dB or more")
        if not 0 < self.share <= 1:
            raise ValueError(f"share = {self.share!r}: expected above 0, at most 1")

    @classmethod
    def even(cls, frequency_hz: Floats, level_m_s2: Floats, tolerance_db: float = 6.0, share: float = 1.0) -> Goal:
        """The same tolerance above and below at every line."""
        same = np.full(frequency_hz.shape, float(tolerance_db))
        return cls(frequency_hz, 20 * np.log10(level_m_s2), same, same, share)

    def margin_db(self, level_db: Floats) -> Floats:
        """To the nearer edge, positive inside: (..., f) of levels (..., f) in dB."""
        error = level_db - self.level_db
        return np.asarray(np.minimum(self.upper_db - error, self.lower_db + error))

    @property
    def required(self) -> int:
        """How many lines must lie within. A share of whole lines: 95 % of 41 lines are 39."""
        return int(np.ceil(self.share * self.frequency_hz.size - 1e-9))

    def met(self, level_db: Floats) -> NDArray[np.bool_]:
        """Whether at least `share` of the lines lies within, (...) of levels (..., f)."""
        return np.asarray(np.count_nonzero(self.margin_db(level_db) >= 0, axis=-1) >= self.required)

    def deciding_line(self, level_db: Floats) -> int:
        """Of levels (f,), the worst of the `required` best lines: within just where the goal is met."""
        return int(np.argsort(-self.margin_db(level_db), kind="stable")[self.required - 1])
