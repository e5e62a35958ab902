"""The prescribed spectrum as the tuner works with it.

What the tuner asks of a forward model, and of the bench around it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from ..setting import Setting
from ..srs.standards import EVERY_LINE, PassRule, RuleResult, rule_results


@dataclass(frozen=True, eq=False)
class Goal:
    """Levels (f,) in dB re 1 m/s2 at `frequency_hz` (f,), and how far a line may lie above and
    below, dB (f,) >= 0.

    An infinite tolerance leaves that side free. `share` of the lines within tolerance makes a
    setting good, and what else `rule` asks of all lines together; 1 asks for every line. Raises
    `ValueError` naming what does not fit.
    """

    frequency_hz: Floats
    level_db: Floats
    upper_db: Floats
    lower_db: Floats
    share: float = 1.0
    rule: PassRule = EVERY_LINE

    def __post_init__(self) -> None:
        for name in ("level_db", "upper_db", "lower_db"):
            values = getattr(self, name)
            if values.shape != self.frequency_hz.shape or np.any(np.isnan(values)):
                raise ValueError(
                    f"{name} has shape {values.shape}: expected {self.frequency_hz.shape}, no NaN"
                )
        if not np.all(np.isfinite(self.level_db)):
            raise ValueError("level_db: expected finite levels")
        if np.any(self.upper_db < 0) or np.any(self.lower_db < 0):
            raise ValueError("upper_db, lower_db: expected 0 dB or more")
        if not 0 < self.share <= 1:
            raise ValueError(f"share = {self.share!r}: expected above 0, at most 1")

    @classmethod
    def even(
        cls, frequency_hz: Floats, level_m_s2: Floats, tolerance_db: float = 6.0, share: float = 1.0
    ) -> Goal:
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
        """Whether at least `share` of the lines lies within and the whole rule is met, (...) of
        levels (..., f)."""
        return np.asarray(np.all([result.met for result in self.results(level_db)], axis=0))

    def results(self, level_db: Floats) -> tuple[RuleResult, ...]:
        """Each rule of levels (..., f), with the lines that keep it."""
        rule = replace(self.rule, share_within=self.share)
        return rule_results(rule, level_db - self.level_db, self.upper_db, self.lower_db)

    def deciding_line(self, level_db: Floats) -> tuple[int, float]:
        """Of levels (f,), the line that decides whether the goal is met, and its margin in dB,
        positive where it is.

        It is the worst of the `required` best lines, or the lowest of those that must lie at the
        level or above it.
        """
        margin, error = self.margin_db(level_db), level_db - self.level_db
        within = int(np.argsort(-margin, kind="stable")[self.required - 1])
        if not (above := self.rule.required_above(self.frequency_hz.size)):
            return within, float(margin[within])
        highest = int(np.argsort(-error, kind="stable")[above - 1])
        return min(
            (within, float(margin[within])),
            (highest, float(error[highest])),
            key=lambda pair: pair[1],
        )


#: For each setting the reasons for which the bench must not fire it; empty where it may.
Refusals = Callable[[Sequence[Setting]], list[tuple[str, ...]]]
#: For each setting what of it the forward model has not been made for; empty inside of its domain.
Outside = Callable[[Sequence[Setting]], list[tuple[str, ...]]]
#: Called with (done, total, what).
Progress = Callable[[int, int, str], None]

#: Levels below this (m/s2) are taken for it: a shot that does not leave the barrel has no
#: logarithm.
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
