"""A prescribed shock response spectrum: break points, straight lines between them on log-log paper,
tolerances."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from .standards import EVERY_LINE, PassRule, RuleResult, Tolerance, rule_results

#: From this many break points per octave on, a target is a table of lines, and its lines are its
#: own points.
TABLE_PER_OCTAVE = 3.0


@dataclass(frozen=True, eq=False)
class Target:
    """A specification at `frequency_hz` (k,), rising; absolute acceleration `level_m_s2` (k,), > 0.

    `upper_db` and `lower_db` (k,) say how far above and below the level a line may lie, both 0 or
    more, infinite for a side that is free; each holds from its point up to the next, as standards
    give tolerances by bands. `rule` is what all lines together must keep to. Raises `ValueError`
    naming the field, the value and what is expected.
    """

    frequency_hz: Floats
    level_m_s2: Floats
    upper_db: Floats
    lower_db: Floats
    rule: PassRule = EVERY_LINE

    def __post_init__(self) -> None:
        k = self.frequency_hz.size
        for name in ("frequency_hz", "level_m_s2", "upper_db", "lower_db"):
            shape = getattr(self, name).shape
            if k == 0 or shape != (k,):
                raise ValueError(
                    f"{name} has shape {shape}: expected one entry per frequency, one or more"
                )
        for name in ("frequency_hz", "level_m_s2"):
            _refuse(
                name, getattr(self, name), "a positive number", lambda x: np.isfinite(x) & (x > 0)
            )
        for name in ("upper_db", "lower_db"):
            _refuse(name, getattr(self, name), "0 dB or more", lambda x: x >= 0)
        if (falling := np.flatnonzero(np.diff(self.frequency_hz) <= 0)).size:
            raise ValueError(
                f"frequency_hz = {self.frequency_hz[falling[0] + 1]:g} follows "
                f"{self.frequency_hz[falling[0]]:g}: expected rising frequencies"
            )

    @property
    def slope_db_per_octave(self) -> Floats:
        """Of each stretch between break points, (k - 1,)."""
        return np.asarray(
            20 * np.diff(np.log10(self.level_m_s2)) / np.diff(np.log2(self.frequency_hz))
        )

    def covers(self, frequency_hz: Floats) -> NDArray[np.bool_]:
        """Which lines lie in its range, (f,); a billionth beyond its ends is rounding.

        Parameters:
            frequency_hz: The lines (f,).
        """
        low, high = self.frequency_hz[0] * (1 - 1e-9), self.frequency_hz[-1] * (1 + 1e-9)
        return np.asarray((frequency_hz >= low) & (frequency_hz <= high))

    def at(self, frequency_hz: Floats) -> Self:
        """The same target at other lines.

        Parameters:
            frequency_hz: The lines (f,), rising.

        Raises:
            ValueError: For a line outside of its range; the message names it.
        """
        if not np.all(inside := self.covers(frequency_hz)):
            raise ValueError(
                f"no level at {frequency_hz[~inside][0]:g} Hz: the target reaches from "
                f"{self.frequency_hz[0]:g} to {self.frequency_hz[-1]:g} Hz"
            )
        own = np.log(self.frequency_hz)
        level = np.exp(np.interp(np.log(frequency_hz), own, np.log(self.level_m_s2)))
        row = (
            np.searchsorted(self.frequency_hz, frequency_hz * (1 + 1e-9), side="right").clip(1) - 1
        )
        return replace(
            self,
            frequency_hz=frequency_hz,
            level_m_s2=level,
            upper_db=self.upper_db[row],
            lower_db=self.lower_db[row],
        )

    def with_tolerance(self, tolerance: Tolerance) -> Self:
        """The same levels with other tolerances and their rule; one more point where a band begins
        between points.

        Parameters:
            tolerance: The tolerances by bands of frequency, and the rule.
        """
        own = self.frequency_hz
        new = np.asarray([f for f in tolerance.from_hz if own[0] < f < own[-1] and f not in own])
        made = self.at(np.sort(np.concatenate([own, new])))
        upper, lower = tolerance.at(made.frequency_hz)
        return replace(made, upper_db=upper, lower_db=lower, rule=tolerance.rule)

    def lines(self, per_octave: int = 6) -> Floats:
        """Lines (f,) to judge it at: its own points where it is a table of lines, else lines in
        equal ratios, both ends included.

        Parameters:
            per_octave: Lines to an octave; 6 by default.
        """
        low, high = float(self.frequency_hz[0]), float(self.frequency_hz[-1])
        octaves = math.log2(high / low)
        if self.frequency_hz.size - 1 >= TABLE_PER_OCTAVE * octaves:
            return self.frequency_hz
        return np.geomspace(low, high, max(2, 1 + math.ceil(per_octave * octaves)))


def ramps(low_hz: float, level_m_s2: float, *stretches: tuple[float, float]) -> Target:
    """A target as specifications tell it: so much at the lowest frequency, then slopes.

    Tolerances are 6 dB either way until `Target.with_tolerance` says otherwise.

    Parameters:
        low_hz: The lowest frequency.
        level_m_s2: The level there.
        stretches: For each slope the frequency in Hz up to which it goes, and the slope in dB per
            octave.

    Raises:
        ValueError: As `Target`.
    """
    frequency, level = [low_hz], [level_m_s2]
    for up_to_hz, slope in stretches:
        level.append(level[-1] * 10 ** (slope * math.log2(up_to_hz / frequency[-1]) / 20))
        frequency.append(up_to_hz)
    six = np.full(len(level), 6.0)
    return Target(np.asarray(frequency, dtype=np.float64), np.asarray(level), six, six)


def _refuse(
    name: str, values: Floats, expected: str, good: Callable[[Floats], NDArray[np.bool_]]
) -> None:
    if not np.all(kept := good(values)):
        at = int(np.flatnonzero(~kept)[0])
        raise ValueError(f"{name} = {values[at]:g} at point {at + 1}: expected {expected}")


@dataclass(frozen=True, eq=False)
class SpectrumComparison:
    """Spectra held against a target at `frequency_hz` (f,), the lines that both have.

    `error_db` (..., f) is 20 log10(spectrum / level); `margin_db` (..., f) the way to the nearer
    edge of the band, positive inside. Per spectrum (...,): `share_within` and `share_above` (the
    level) of the lines, the smallest margin and its frequency. `rules` are those of the target,
    each with the lines that keep it.
    """

    frequency_hz: Floats
    target: Target
    error_db: Floats
    margin_db: Floats
    share_within: Floats
    share_above: Floats
    worst_margin_db: Floats
    worst_frequency_hz: Floats
    rules: tuple[RuleResult, ...]

    @property
    def met(self) -> NDArray[np.bool_]:
        """Whether every rule of the target is met, (...,)."""
        return np.asarray(np.all([rule.met for rule in self.rules], axis=0))

    def sentence(self, place: tuple[int, ...] = ()) -> str:
        """What the verdict on one spectrum rests on; the rules that are not met stand first.

        Parameters:
            place: Indices of the spectrum among the spectra (...,); by default (), for a single
                one.
        """
        rule = self.target.rule
        judged = (
            f" ({', '.join(part for part in (rule.name, rule.clause) if part)})"
            if rule.name
            else ""
        )
        results = sorted(self.rules, key=lambda result: bool(result.met[place]))
        verdict = "met" if bool(self.met[place]) else "missed"
        return (
            f"target {verdict}{judged}: {'; '.join(result.sentence(place) for result in results)}"
        )

    @property
    def within(self) -> NDArray[np.bool_]:
        """Whether every line lies within its tolerance, (...,)."""
        return np.asarray(self.worst_margin_db >= 0)


def compare(maximax_m_s2: Floats, frequency_hz: Floats, target: Target) -> SpectrumComparison:
    """Spectra against a target. Lines outside of the target's range are left out.

    An edge belongs to the band, to within rounding.

    Parameters:
        maximax_m_s2: Spectra (..., f), absolute acceleration.
        frequency_hz: Their lines (f,), rising.
        target: The prescribed spectrum with its tolerances.

    Raises:
        ValueError: Where no line lies in the target's range.
    """
    inside = target.covers(frequency_hz)
    if not np.any(inside):
        raise ValueError(
            f"no line of the spectrum ({frequency_hz.min():g} to {frequency_hz.max():g} Hz) lies "
            f"in the target's range ({target.frequency_hz[0]:g} to {target.frequency_hz[-1]:g} Hz)"
        )
    lines = target.at(frequency_hz[inside])
    with np.errstate(divide="ignore"):  # no response at all is -inf dB
        error = 20 * np.log10(maximax_m_s2[..., inside] / lines.level_m_s2)
    error = np.where(np.abs(error) < 1e-9, 0.0, error)
    margin = np.minimum(lines.upper_db - error, lines.lower_db + error)
    margin = np.where(np.abs(margin) < 1e-9, 0.0, margin)
    worst = margin.argmin(axis=-1)
    return SpectrumComparison(
        frequency_hz=lines.frequency_hz,
        target=lines,
        error_db=error,
        margin_db=margin,
        share_within=np.asarray((margin >= 0).mean(axis=-1)),
        share_above=np.asarray((error >= 0).mean(axis=-1)),
        worst_margin_db=np.asarray(margin.min(axis=-1)),
        worst_frequency_hz=lines.frequency_hz[worst],
        rules=rule_results(lines.rule, error, lines.upper_db, lines.lower_db),
    )
