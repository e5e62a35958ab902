"""When a gap is taken for a mistake of unit."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal, Self

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats

Severity = Literal["name", "refuse"]

_REMEDY = {
    "velocity": "correct its column in runs.csv, or the laser's channel in campaign.toml",
    "tank_pressure": "correct tank_pressure_bar in runs.csv, or the transducer's channel in campaign.toml",
    "sampling rate": "correct the rate that the recordings state in hertz",
}
_SENSOR_REMEDY = "correct its unit or sensitivity in campaign.toml"

#: A gap below this (nats) is not looked into: physics explains a factor of 1.9.
WORTH_A_LOOK = math.log(1.9)
#: Factors from here on are refused when they fit within `_FIT`, the same within `_SAME` in all configurations.
_REFUSED_FROM, _FIT, _SAME = math.log(3.0), math.log(1.05), 0.10
#: ... and leave no more than this of all observables: a soft layer takes a third of the peak as well, but it lengthens
#: the pulse, which no unit does.
_LEFT = 0.35
#: Factors beyond any physics of a bench are refused by their order of magnitude.
_BEYOND_PHYSICS, ORDER = math.log(20.0), math.log(2.5)
#: What is only named fits within `_NEAR`, a factor below that within `_NEAR_SMALL`: losses come on top of it.
_NEAR, _NEAR_SMALL, _NEAR_SAME = 0.25, 0.10, 0.20
#: So many mistakes are named where several fit.
_NAMED = 3


@dataclass(frozen=True)
class LikelyMistake:
    """A likely mistake. `message` names the thing, its value and the next step, in one line.

    `name`: worth a look, and said in the report. `refuse`: the record is not what it says, and is not diagnosed.
    """

    severity: Severity
    channel: str  # "force", "velocity", "tank_pressure", "acceleration_1", or a setting's name
    message: str


class ImplausibleRecordError(ValueError):
    """A campaign's record cannot be what it says; the message names channel, ratio, likely mistake and next step."""


@dataclass(frozen=True)
class LogGap:
    """A gap in nats: its centre over configurations, its scatter about that, its root mean square; NaN for none."""

    centre: float
    scatter: float
    rms: float

    @classmethod
    def of(cls, nats: Floats, decisive: NDArray[np.bool_] | slice = slice(None)) -> Self:
        """Of logarithms (C, k); centre and scatter are those of the `decisive` columns (k,)."""
        from scipy.stats import median_abs_deviation

        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)  # a configuration without any has no mean
            means = np.nanmean(nats[:, decisive], axis=1)
        means = means[np.isfinite(means)]
        if means.size == 0:
            return cls(math.nan, math.nan, math.nan)
        scatter = median_abs_deviation(means, scale="normal")
        return cls(float(np.median(means)), float(scatter), float(np.sqrt(np.nanmean(nats**2))))


@dataclass(frozen=True)
class Suspicion:
    """A mistake that would explain a gap. `shift`, in nats, is what it does to the reading."""

    channel: str
    mistake: str
    shift: float
    remaining: LogGap

    @property
    def severity(self) -> Severity | None:
        """None where it does not fit well enough to be said."""
        size, off, scatter = abs(self.shift), abs(self.remaining.centre), self.remaining.scatter
        fits = size >= _REFUSED_FROM and off <= _FIT and scatter <= _SAME and self.remaining.rms <= _LEFT
        if fits or (size >= _BEYOND_PHYSICS and off <= ORDER):
            return "refuse"
        near = _NEAR if size >= _REFUSED_FROM else _NEAR_SMALL
        return "name" if size >= WORTH_A_LOOK and off <= near and scatter <= _NEAR_SAME else None


def unit_finding(reading: str, stage: str, gap: LogGap, suspicions: Iterable[Suspicion]) -> LikelyMistake | None:
    """`reading` is off by `gap` from what `stage` gives: the likeliest of the mistakes that would explain it, least
    remaining gap first; with a refusal among them only refusals. None where no mistake fits."""
    fits = sorted((item for item in suspicions if item.severity), key=lambda item: item.remaining.rms)
    suspects = [item for item in fits if item.severity == "refuse"] or fits
    if not suspects:
        return None
    first = suspects[0]
    texts = list(dict.fromkeys(f"{suspect.channel}: {suspect.mistake}" for suspect in suspects))[:_NAMED]
    message = (
        f"{reading} is {math.exp(gap.centre):.3g} times what the {stage} can give ({gap.scatter:.0%} scatter between "
        f"configurations), which a wrong unit does and physics hardly: is it {', or '.join(texts)}? "
        f"{_REMEDY.get(first.channel, _SENSOR_REMEDY)}"
    )
    return LikelyMistake(first.severity or "name", first.channel, message)
