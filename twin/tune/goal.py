"""The prescribed spectrum as the tuner works with it.

What the tuner asks of a forward model, and of the bench around it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from ..setting import Setting


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


#: For each setting the reasons for which the bench must not fire it; empty where it may.
Refusals = Callable[[Sequence[Setting]], list[tuple[str, ...]]]
#: For each setting what of it the forward model has not been made for; empty inside of its domain.
Outside = Callable[[Sequence[Setting]], list[tuple[str, ...]]]
#: Called with (done, total, what).
Progress = Callable[[int, int, str], None]

#: Levels below this (m/s2) are taken for it: a shot that does not leave the barrel has no logarithm.
FLOOR_M_S2 = 1e-3


class Forward(Protocol):
    """Settings to the maximax shock response spectrum (m/s2) at one sensor."""

    @property
    def frequency_hz(self) -> Floats:
        """Lines (f,), rising."""
        ...

    def spectra(self, settings: Sequence[Setting]) -> Floats:
        """Nominal spectra (n, f)."""
        ...

    def draws(self, settings: Sequence[Setting], count: int, rng: np.random.Generator) -> Floats:
        """Random spectra (count, n, f): what the model itself does not know."""
        ...


def level_db(spectra_m_s2: Floats) -> Floats:
    """20 log10 of spectra in m/s2, any shape, finite."""
    return np.asarray(20 * np.log10(np.maximum(spectra_m_s2, FLOOR_M_S2)))


def nothing_refused(settings: Sequence[Setting]) -> list[tuple[str, ...]]:
    """A bench, or a model, without limits."""
    return [()] * len(settings)
