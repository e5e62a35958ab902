"""Wrong units: a gap that is one known factor everywhere, at a stage's exit, at its entrance or in its clock.

A factor at the entrance is tried through the stage itself: a velocity that reads too high raises the peak and the
impulse and shortens the pulse, each in its own measure, which a wrong unit of force does not.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from ..observables.base import Stage, Upstream
from ..record import CampaignRecord, Floats
from .finding import Finding
from .levels import Column, Gap, by_configuration, columns_of
from .mistakes import mistakes
from .suspicion import ORDER, WORTH_A_LOOK, Suspicion, fitting, unit_finding

#: What is read at a stage's entrance, its quantity, and its name in a run.
_ENTRANCE = {
    "gun": ("tank_pressure", "pressure", "tank_pressure_pa"),
    "contact": ("velocity", "velocity", "velocity_m_s"),
}
#: Channel, mistake, and the gap (C, d) that is left when it is undone.
_Tried = tuple[str, str, Floats]


def unit_findings(record: CampaignRecord, stages: Sequence[Stage]) -> list[Finding]:
    """Of gun and contact, at most one for each likeliest mistake's channel: that of the larger gap."""
    found: dict[str, tuple[float, Finding]] = {}
    for stage in stages:
        if stage.name not in _ENTRANCE:
            continue  # the plate's records tell more than its levels (`channels`)
        for now, finding in _of_stage(record, stage):
            if finding.channel not in found or found[finding.channel][0] < now.rms:
                found[finding.channel] = now.rms, finding
    return [finding for _, finding in found.values()]


def _of_stage(record: CampaignRecord, stage: Stage) -> Iterator[tuple[Gap, Finding]]:
    """For each channel at the stage's exit whose gap is worth a look and like a mistake."""
    columns, measured, nominal = columns_of(stage), stage.measured(), stage.simulated()
    gap = by_configuration(record, measured - nominal)
    entered: list[_Tried] | None = None
    for channel in dict.fromkeys(column.channel for column in columns):
        mine = [column for column in columns if column.channel == channel]
        now = _left(gap, mine)
        if now is None or max(abs(now.centre), now.rms / 2) < WORTH_A_LOOK:
            continue
        if entered is None:
            entered = list(_at_entrance(record, stage, measured))
        tried = [*_at_exit(gap, mine, channel), *_of_clock(gap, mine), *_seen_on(entered, mine, now)]
        if suspects := fitting(tried):
            yield now, unit_finding(channel, stage.name, now, suspects)


def _at_exit(gap: Floats, mine: Sequence[Column], channel: str) -> Iterator[Suspicion]:
    for mistake in mistakes(channel.split("_")[0]):
        shift = math.log(mistake.reads)
        left = _left(gap, mine, [shift if column.scales else 0.0 for column in mine])
        if left is not None:
            yield Suspicion(channel, mistake.what, shift, left)


def _of_clock(gap: Floats, mine: Sequence[Column]) -> Iterator[Suspicion]:
    """A sampling rate that reads too high shortens pulses by as much."""
    times = _left(gap, [column for column in mine if column.kind == "time"])
    if times is None:
        return
    for mistake in mistakes("clock"):
        shift = -math.log(mistake.reads)
        left = _left(gap, mine, [column.clock_shift(shift) for column in mine])
        if left is not None and abs(times.centre - shift) < ORDER:
            yield Suspicion("sampling rate", mistake.what, shift, left)


def _at_entrance(record: CampaignRecord, stage: Stage, measured: Floats) -> Iterator[_Tried]:
    channel, quantity, name = _ENTRANCE[stage.name]
    values = [getattr(run, name) for run in record.runs]
    read = np.array([math.nan if value is None else value for value in values], dtype=np.float64)
    for mistake in mistakes(quantity):
        true: Upstream = (read / mistake.reads).tolist()
        yield channel, mistake.what, by_configuration(record, measured - stage.simulated(upstream=true))


def _seen_on(entered: Sequence[_Tried], mine: Sequence[Column], now: Gap) -> Iterator[Suspicion]:
    for channel, what, gap in entered:
        left = _left(gap, mine)
        if left is not None:
            yield Suspicion(channel, what, now.centre - left.centre, left)


def _left(gap: Floats, mine: Sequence[Column], shifts: Sequence[float] | None = None) -> Gap | None:
    """Of the columns `mine` of a gap (C, d), less `shifts` in nats."""
    if not mine:
        return None
    nats = np.column_stack([gap[:, column.place] * column.nats for column in mine])
    nats = nats - np.array(shifts if shifts is not None else [0.0] * len(mine))
    decisive = [i for i, column in enumerate(mine) if column.scales]
    return Gap.of(nats, nats[:, decisive] if decisive else nats)
