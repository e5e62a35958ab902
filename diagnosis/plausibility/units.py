"""Wrong units: a gap that is one known factor everywhere, at a stage's exit, at its entrance or in its clock.

A factor at the entrance is tried through the stage itself: a velocity that reads too high raises the peak and the
impulse and shortens the pulse, each in its own measure, which a wrong unit of force does not.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ..observables.base import Observable, Stage
from ..record import CampaignRecord, Floats
from .unit_factors import ORDER, WORTH_A_LOOK, Finding, LogGap, Suspicion, fitting, mistakes, unit_finding

ATMOSPHERE_PA = 101_325.0
#: One atmosphere is suspected where taking it off leaves a third of a gap of this size (nats), and no more than that.
_PRESSURE_GAP, _PRESSURE_SHARE, _PRESSURE_REST = 0.15, 1 / 3, 0.05
#: In nats: pressures that differ by less cannot tell an atmosphere from a factor.
_PRESSURE_SPAN = 0.2
#: What is read at a stage's entrance, its quantity, and its name in a run.
_ENTRANCE = {
    "gun": ("tank_pressure", "pressure", "tank_pressure_pa"),
    "contact": ("velocity", "velocity", "velocity_m_s"),
}
_NATS_PER_DB = math.log(10) / 20
#: Observables that are logarithms, by the beginning of their names.
_KINDS = {
    "ln_velocity": "amplitude",
    "ln_peak": "amplitude",
    "ln_impulse": "impulse",
    "ln_width": "time",
    "ln_contact_time": "time",
}
#: Channel, mistake, and the gap (C, d) that remains when it is undone.
_Undone = tuple[str, str, Floats]


@dataclass(frozen=True)
class _Column:
    """An observable that is a logarithm, its place in the stage, and what nats there are in its unit.

    `kind` is "amplitude", "time" or "impulse".
    """

    place: int
    channel: str
    kind: str
    nats: float

    @property
    def scales(self) -> bool:
        """Whether a wrong unit of its channel shifts it."""
        return self.kind != "time"


def unit_findings(record: CampaignRecord, stages: Sequence[Stage]) -> list[Finding]:
    """Of gun and contact, at most one for each likeliest mistake's channel: that of the larger gap."""
    largest: dict[str, tuple[float, Finding]] = {}
    for stage in stages:
        if stage.name not in _ENTRANCE:
            continue  # the plate's records tell more than its levels (`channels`)
        for gap, finding in _of_stage(record, stage):
            if finding.channel not in largest or largest[finding.channel][0] < gap.rms:
                largest[finding.channel] = gap.rms, finding
    return [finding for _, finding in largest.values()]


def absolute_pressure(record: CampaignRecord, stages: Sequence[Stage]) -> list[Finding]:
    """At most a hint: air in front of the projectile takes much the same from a velocity."""
    stage = next((stage for stage in stages if stage.name == "gun"), None)
    pressure = _readings(record, "tank_pressure_pa")
    known = pressure[np.isfinite(pressure)]
    if stage is None or known.size == 0 or known.min() <= ATMOSPHERE_PA or np.ptp(np.log(known)) < _PRESSURE_SPAN:
        return []
    gauge = (pressure - ATMOSPHERE_PA).tolist()
    before, after = (
        _rms(_by_configuration(record, stage.measured() - simulated))
        for simulated in (stage.simulated(), stage.simulated(upstream=gauge))
    )
    if before < _PRESSURE_GAP or after > min(_PRESSURE_REST, _PRESSURE_SHARE * before):
        return []
    message = (
        f"tank_pressure: one atmosphere less takes the velocity's gap from {before:.0%} to {after:.0%}: are the "
        "pressures absolute? tank_pressure_bar in runs.csv is gauge"
    )
    return [Finding("name", "tank_pressure", message)]


def _of_stage(record: CampaignRecord, stage: Stage) -> Iterator[tuple[LogGap, Finding]]:
    """For each channel at the stage's exit whose gap is worth a look and like a mistake."""
    columns = [column for place, item in enumerate(stage.observables) for column in _columns(place, item)]
    measured = stage.measured()
    table = _by_configuration(record, measured - stage.simulated())
    undone: list[_Undone] | None = None
    for channel in dict.fromkeys(column.channel for column in columns):
        concerned = [column for column in columns if column.channel == channel]
        gap = _log_gap(table, concerned)
        if not max(abs(gap.centre), gap.rms / 2) >= WORTH_A_LOOK:
            continue
        if undone is None:
            undone = list(_undone_at_entrance(record, stage, measured))
        suspicions = list(_shifted(table, concerned))
        for entrance, mistake, remaining in undone:
            rest = _log_gap(remaining, concerned)
            suspicions.append(Suspicion(entrance, mistake, gap.centre - rest.centre, rest))
        if suspects := fitting(suspicions):
            yield gap, unit_finding(channel, stage.name, gap, suspects)


def _columns(place: int, item: Observable) -> Iterator[_Column]:
    """At most one, for levels in dB and for logarithms of velocity, force, impulse and width."""
    if item.unit == "dB":
        yield _Column(place, item.channel, "amplitude", _NATS_PER_DB)
    elif item.unit == "1":
        kinds = [kind for beginning, kind in _KINDS.items() if item.name.startswith(beginning)]
        yield from (_Column(place, item.channel, kind, 1.0) for kind in kinds)


def _shifted(table: Floats, columns: Sequence[_Column]) -> Iterator[Suspicion]:
    """Mistakes of the channel at the exit, and of the clock: a rate that reads too high shortens pulses by as much."""
    channel = columns[0].channel
    for factor, mistake in mistakes(channel.split("_")[0]):
        shift = math.log(factor)
        rest = _log_gap(table, columns, [shift if column.scales else 0.0 for column in columns])
        yield Suspicion(channel, mistake, shift, rest)
    times = [column for column in columns if column.kind == "time"]
    for factor, mistake in mistakes("clock") if times else ():
        shift = -math.log(factor)
        if abs(_log_gap(table, times).centre - shift) < ORDER:
            rest = _log_gap(table, columns, [0.0 if column.kind == "amplitude" else shift for column in columns])
            yield Suspicion("sampling rate", mistake, shift, rest)


def _undone_at_entrance(record: CampaignRecord, stage: Stage, measured: Floats) -> Iterator[_Undone]:
    channel, quantity, name = _ENTRANCE[stage.name]
    for factor, mistake in mistakes(quantity):
        simulated = stage.simulated(upstream=(_readings(record, name) / factor).tolist())
        yield channel, mistake, _by_configuration(record, measured - simulated)


def _readings(record: CampaignRecord, name: str) -> Floats:
    """(R,): NaN where a run has none."""
    return np.array([getattr(run, name) for run in record.runs], dtype=np.float64)


def _by_configuration(record: CampaignRecord, values: Floats) -> Floats:
    """(C, d): medians of (R, d) over the runs of each configuration; NaN where there is none."""
    of = record.configuration_of
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # a column of NaN has no median, which is the answer
        rows = [np.nanmedian(values[of == c], axis=0) for c in range(len(record.configurations))]
    return np.array(rows, dtype=np.float64).reshape(len(record.configurations), values.shape[1])


def _log_gap(table: Floats, columns: Sequence[_Column], shifts: Sequence[float] | float = 0.0) -> LogGap:
    """Of these columns of a gap (C, d), less `shifts` in nats."""
    nats = np.column_stack([table[:, column.place] * column.nats for column in columns]) - np.asarray(shifts)
    decisive = [i for i, column in enumerate(columns) if column.scales]
    return LogGap.of(nats, nats[:, decisive] if decisive else nats)


def _rms(gap: Floats) -> float:
    return float(np.sqrt(np.nanmean(gap**2))) if np.isfinite(gap).any() else math.inf
