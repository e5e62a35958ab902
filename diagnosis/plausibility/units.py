"""Wrong units: a gap that is one known factor everywhere, at a stage's exit, at its entrance or in
its clock.

A factor at the entrance is tried through the stage itself: a velocity that reads too high raises
the peak and the impulse and shortens the pulse, each in its own measure, which a wrong unit of
force does not.

When a gap is taken for a mistake of unit.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal, Self

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from ...ingest.folder.unit_mistakes import unit_mistakes
from ...twin.gun.shot import ATMOSPHERE_PA
from ..observables.base import Stage
from ..record import CampaignRecord

Severity = Literal["name", "refuse"]

_REMEDY = {
    "velocity": "correct its column in runs.csv, or the laser's channel in campaign.toml",
    "tank_pressure": "correct tank_pressure_bar in runs.csv, "
    "or the transducer's channel in campaign.toml",
    "sampling rate": "correct the rate that the recordings state in hertz",
}
_SENSOR_REMEDY = "correct its unit or sensitivity in campaign.toml"

#: A gap below this (nats) is not looked into: physics explains a factor of 1.9.
WORTH_A_LOOK = math.log(1.9)
#: Factors from here on are refused when they fit within `_FIT`, the same within `_SAME` in all
#: configurations.
_REFUSED_FROM, _FIT, _SAME = math.log(3.0), math.log(1.05), 0.10
#: ... and leave no more than this of all observables: a soft layer takes a third of the peak as
#: well, but it lengthens the pulse, which no unit does.
_LEFT = 0.35
#: Factors beyond any physics of a bench are refused by their order of magnitude.
_BEYOND_PHYSICS, ORDER = math.log(20.0), math.log(2.5)
#: What is only named fits within `_NEAR`, a factor below that within `_NEAR_SMALL`: losses come on
#: top of it.
_NEAR, _NEAR_SMALL, _NEAR_SAME = 0.25, 0.10, 0.20
#: Momentum bounds an impulse: mass times velocity to twice that, whatever lies between impactor and
#: target. Within this gap (nats) of the impulse force and velocity have the right units, however
#: small a soft layer makes the peak.
_IMPULSE_BY_PHYSICS = math.log(2.3)
#: So many mistakes are named where several fit.
_NAMED = 3


@dataclass(frozen=True)
class LikelyMistake:
    """A likely mistake. `message` names the thing, its value and the next step, in one line.

    `name`: worth a look, and said in the report. `refuse`: the record is not what it says, and is
    not diagnosed.
    """

    severity: Severity
    channel: str  # "force", "velocity", "tank_pressure", "acceleration_1", or a setting's name
    message: str


class ImplausibleRecordError(ValueError):
    """A campaign's record cannot be what it says; the message names channel, ratio, likely mistake
    and next step."""


@dataclass(frozen=True)
class LogGap:
    """A gap in nats: its centre over configurations, its scatter about that, its root mean square;
    NaN for none."""

    centre: float
    scatter: float
    rms: float

    @classmethod
    def of(cls, nats: Floats, decisive: NDArray[np.bool_] | slice = slice(None)) -> Self:
        """The gap of a table of logarithms.

        Parameters:
            nats: Natural logarithms (C, k) of measured over simulated values; NaN where a
                configuration has none.
            decisive: Which of the columns (k,) centre and scatter are taken from; by default all.
        """
        from scipy.stats import median_abs_deviation

        with warnings.catch_warnings():
            warnings.simplefilter(
                "ignore", RuntimeWarning
            )  # a configuration without any has no mean
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
        fits = (
            size >= _REFUSED_FROM
            and off <= _FIT
            and scatter <= _SAME
            and self.remaining.rms <= _LEFT
        )
        if fits or (size >= _BEYOND_PHYSICS and off <= ORDER):
            return "refuse"
        near = _NEAR if size >= _REFUSED_FROM else _NEAR_SMALL
        return "name" if size >= WORTH_A_LOOK and off <= near and scatter <= _NEAR_SAME else None


def unit_finding(
    reading: str, stage: str, gap: LogGap, suspicions: Iterable[Suspicion]
) -> LikelyMistake | None:
    """The likeliest of the mistakes that would explain a gap, least remaining gap first; with a
    refusal among them only refusals. None where no mistake fits.

    Parameters:
        reading: The name of the quantity that is off, as the message has it.
        stage: The name of the stage from whose simulation it is off.
        gap: The gap by which it is off.
        suspicions: The mistakes that are tried, each with the gap that it would leave.
    """
    fits = sorted(
        (item for item in suspicions if item.severity), key=lambda item: item.remaining.rms
    )
    suspects = [item for item in fits if item.severity == "refuse"] or fits
    if not suspects:
        return None
    first = suspects[0]
    texts = list(dict.fromkeys(f"{suspect.channel}: {suspect.mistake}" for suspect in suspects))[
        :_NAMED
    ]
    message = (
        f"{reading} is {math.exp(gap.centre):.3g} times what the {stage} can give "
        f"({gap.scatter:.0%} scatter between configurations), which a wrong unit does and physics "
        f"hardly: is it {', or '.join(texts)}? {_REMEDY.get(first.channel, _SENSOR_REMEDY)}"
    )
    return LikelyMistake(first.severity or "name", first.channel, message)


#: One atmosphere is suspected where taking it off leaves a third of a gap of this size (nats), and
#: no more than that.
_PRESSURE_GAP, _PRESSURE_SHARE, _PRESSURE_REST = 0.15, 1 / 3, 0.05
#: In nats: pressures that differ by less cannot tell an atmosphere from a factor.
_PRESSURE_SPAN = 0.2
#: What is read at a stage's entrance, its quantity, and its name in a run. The plate's records tell
#: more than its levels do (`channels`).
_ENTRANCE = {
    "gun": ("tank_pressure", "pressure", "tank_pressure_pa"),
    "contact": ("velocity", "velocity", "velocity_m_s"),
}
#: Powers with which an amplitude, and a length of time, enter an observable, by the beginning of
#: its name.
_POWERS = {"ln_velocity": (1, 0), "ln_peak": (1, 0), "ln_impulse": (1, 1), "ln_width": (0, 1)}


def unit_findings(record: CampaignRecord, stages: Sequence[Stage]) -> list[LikelyMistake]:
    """Mistakes of gun and contact, at most one for each likeliest mistake's channel: that of the
    larger gap.

    Parameters:
        record: The campaign.
        stages: Its nominal stages; those of other names than gun and contact are passed over.
    """
    largest: dict[str, tuple[float, LikelyMistake]] = {}
    for stage in stages:
        suspected = _stage_finding(record, stage) if stage.name in _ENTRANCE else None
        if suspected is not None:
            channel = suspected[1].channel
            largest[channel] = max(
                largest.get(channel, suspected), suspected, key=lambda item: item[0]
            )
    return [finding for _, finding in largest.values()]


def absolute_pressure(record: CampaignRecord, stages: Sequence[Stage]) -> list[LikelyMistake]:
    """At most a hint that pressures are absolute: air in front of the projectile takes much the
    same from a velocity.

    Parameters:
        record: The campaign.
        stages: Its nominal stages; without a gun there is no hint.
    """
    stage = next((stage for stage in stages if stage.name == "gun"), None)
    pressure = _readings(record, "tank_pressure_pa")
    measured = pressure[np.isfinite(pressure)]
    if stage is None or not measured.size or measured.min() <= ATMOSPHERE_PA:
        return []
    if np.ptp(np.log(measured)) < _PRESSURE_SPAN:
        return []
    gauge = (pressure - ATMOSPHERE_PA).tolist()
    residuals = [(stage.measured() - stage.simulated(upstream=p))[:, :1] for p in (None, gauge)]
    gaps = [_by_configuration(record, velocity) for velocity in residuals]
    before, after = (LogGap.of(gap).rms for gap in gaps)
    if before < _PRESSURE_GAP or not after <= min(_PRESSURE_REST, _PRESSURE_SHARE * before):
        return []
    message = (
        f"tank_pressure: one atmosphere less takes the velocity's gap from {before:.0%} to "
        f"{after:.0%}: are the pressures absolute? tank_pressure_bar in runs.csv is gauge"
    )
    return [LikelyMistake("name", "tank_pressure", message)]


def _stage_finding(record: CampaignRecord, stage: Stage) -> tuple[float, LikelyMistake] | None:
    """Of a gap at the stage's exit that is worth a look and like a mistake: its root mean square,
    and what it is."""
    powers = {
        place: pair
        for place, item in enumerate(stage.observables)
        for beginning, pair in _POWERS.items()
        if item.name.startswith(beginning)
    }
    columns, channel, measured = list(powers), stage.observables[0].channel, stage.measured()
    amplitude, time = np.array(list(powers.values()), dtype=np.float64).T
    scaled = amplitude > 0  # by a wrong unit of the channel
    nats = _by_configuration(record, measured - stage.simulated())[:, columns]
    gap = LogGap.of(nats, scaled)
    impulse = [
        place
        for place, column in enumerate(columns)
        if stage.observables[column].name == "ln_impulse"
    ]
    if not max(abs(gap.centre), gap.rms / 2) >= WORTH_A_LOOK or _is_by_physics(
        LogGap.of(nats[:, impulse])
    ):
        return None
    suspicions = []
    for factor, mistake in unit_mistakes(channel):
        shift = math.log(factor)
        suspicions.append(
            Suspicion(channel, mistake, shift, LogGap.of(nats - shift * amplitude, scaled))
        )
    for factor, mistake in unit_mistakes("clock"):
        shift = -math.log(factor)  # a rate that reads too high shortens pulses by as much
        if abs(LogGap.of(nats[:, ~scaled]).centre - shift) < ORDER:
            suspicions.append(
                Suspicion("sampling rate", mistake, shift, LogGap.of(nats - shift * time, scaled))
            )
    entrance, quantity, name = _ENTRANCE[stage.name]
    for factor, mistake in unit_mistakes(quantity):
        simulated = stage.simulated(upstream=(_readings(record, name) / factor).tolist())
        remaining = LogGap.of(_by_configuration(record, measured - simulated)[:, columns], scaled)
        suspicions.append(Suspicion(entrance, mistake, gap.centre - remaining.centre, remaining))
    finding = unit_finding(channel, stage.name, gap, suspicions)
    return (gap.rms, finding) if finding else None


def _is_by_physics(impulse: LogGap) -> bool:
    """Whether the gap of the impulses is one that momentum allows: they are what mass and velocity
    make them, which a wrong unit of force, velocity or time changes by its whole factor. False
    where there is none."""
    return abs(impulse.centre) <= _IMPULSE_BY_PHYSICS


def _readings(record: CampaignRecord, name: str) -> Floats:
    """(R,): NaN where a run has none."""
    return np.array([getattr(run, name) for run in record.runs], dtype=np.float64)


def _by_configuration(record: CampaignRecord, values: Floats) -> Floats:
    """(C, d): medians of (R, d) over the runs of each configuration; NaN where there is none."""
    of = record.configuration_of
    with warnings.catch_warnings():
        warnings.simplefilter(
            "ignore", RuntimeWarning
        )  # a column of NaN has no median, which is the answer
        rows = [np.nanmedian(values[of == c], axis=0) for c in range(len(record.configurations))]
    return np.array(rows, dtype=np.float64).reshape(len(record.configurations), values.shape[1])
