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
        """A goal with the same tolerance above and below at every line.

        Parameters:
            frequency_hz: The lines (f,).
            level_m_s2: The level at each line (f,).
            tolerance_db: How far a line may lie above or below its level; 6 dB by default.
            share: Share of the lines that must lie within tolerance; by default 1, every line.

        Raises:
            ValueError: As the class.
        """
        same = np.full(frequency_hz.shape, float(tolerance_db))
        return cls(frequency_hz, 20 * np.log10(level_m_s2), same, same, share)

    def margin_db(self, level_db: Floats) -> Floats:
        """The distance to the nearer edge of the tolerance in dB, positive inside, (..., f).

        Parameters:
            level_db: Levels (..., f) of spectra, dB re 1 m/s2.
        """
        error = level_db - self.level_db
        return np.asarray(np.minimum(self.upper_db - error, self.lower_db + error))

    @property
    def required(self) -> int:
        """How many lines must lie within. A share of whole lines: 95 % of 41 lines are 39."""
        return int(np.ceil(self.share * self.frequency_hz.size - 1e-9))

    def met(self, level_db: Floats) -> NDArray[np.bool_]:
        """Whether at least `share` of the lines lies within and the whole rule is met, (...).

        Parameters:
            level_db: Levels (..., f) of spectra, dB re 1 m/s2.
        """
        return np.asarray(np.all([result.met for result in self.results(level_db)], axis=0))

    def results(self, level_db: Floats) -> tuple[RuleResult, ...]:
        """Each rule, with the lines that keep it.

        Parameters:
            level_db: Levels (..., f) of spectra, dB re 1 m/s2.
        """
        rule = replace(self.rule, share_within=self.share)
        return rule_results(rule, level_db - self.level_db, self.upper_db, self.lower_db)

    def deciding_line(self, level_db: Floats) -> tuple[int, float]:
        """The line that decides whether the goal is met, and its margin in dB, positive where it
        is.

        It is the worst of the `required` best lines, or the lowest of those that must lie at the
        level or above it.

        Parameters:
            level_db: Levels (f,) of one spectrum, dB re 1 m/s2.

        Returns:
            The index of the line, from 0, and the margin.
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
        """Nominal spectra (n, f), m/s2.

        Parameters:
            settings: n settings of the bench.
        """
        ...

    def draws(self, settings: Sequence[Setting], count: int, rng: np.random.Generator) -> Floats:
        """Random spectra (count, n, f), m/s2: what the model itself does not know.

        Parameters:
            settings: n settings of the bench.
            count: How many random spectra each setting gets.
            rng: Generator of the random numbers.
        """
        ...


def level_db(spectra_m_s2: Floats) -> Floats:
    """20 log10 of spectra, of their shape, finite.

    Parameters:
        spectra_m_s2: Spectra, an array of any shape; less than 0.001 m/s2 is taken for that.
    """
    return np.asarray(20 * np.log10(np.maximum(spectra_m_s2, FLOOR_M_S2)))


def nothing_refused(settings: Sequence[Setting]) -> list[tuple[str, ...]]:
    """Refuses nothing: a bench, or a model, without limits.

    Parameters:
        settings: n settings of the bench.

    Returns:
        n empty tuples of reasons.
    """
    return [()] * len(settings)
