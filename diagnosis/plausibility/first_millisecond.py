"""The first millisecond of each accelerometer's record against the plate: correlations and gains.

So early, neither damping nor a few per cent of stiffness have moved the record far, and a correlation knows no unit.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ...twin.plate.modal import ModalPlate
from ...twin.plate.respond import kept_below, respond
from ..record import CampaignRecord, Floats, Run, Series

#: From the start of contact on; longer where the force takes longer, to so many times its rise.
EARLY_S, RISES = 1e-3, 2.0
#: Share of the sampling rate up to which the plate's modes are asked.
_BELOW = 0.45


@dataclass(frozen=True, eq=False)
class EarlyFits:
    """k channels that are the plate's sensors, in C configurations that have them and the force.

    `correlation` (k, k): medians over configurations, each channel's record (rows) with each sensor's simulation
    (columns). `log_gain` (C, k): logarithm of how much of its own simulation a record holds, whatever its sign.
    """

    names: tuple[str, ...]
    correlation: Floats
    log_gain: Floats


def early_fits(record: CampaignRecord) -> EarlyFits | None:
    """None where the plate is not known, or no run has both force and accelerations."""
    plate = record.plate
    if plate is None:
        return None
    names = tuple(name for name in plate.sensors if any(name in run.accelerations for run in record.runs))
    found = [_compared(plate, run, names, point) for run, point in _typical(record, names)] if names else []
    if not found:
        return None
    correlation = np.median([each[0] for each in found], axis=0)
    return EarlyFits(names, correlation, np.array([each[1] for each in found]))


def _typical(record: CampaignRecord, names: tuple[str, ...]) -> Iterator[tuple[Run, str]]:
    """A run of each configuration that shows everything, and where it hit."""
    of = record.configuration_of
    for c, configuration in enumerate(record.configurations):
        runs = [run for run, mine in zip(record.runs, of == c, strict=True) if mine and run.force is not None]
        usable = [run for run in runs if all(name in run.accelerations for name in names)]
        if usable:
            yield usable[len(usable) // 2], str(configuration.factors.get("impact_position", ""))


def _compared(plate: ModalPlate, run: Run, names: tuple[str, ...], point: str) -> tuple[Floats, Floats]:
    """(k, k) correlations and (k,) logarithms of gains."""
    rate = run.accelerations[names[0]].sampling_rate_hz
    time = np.arange(round(_span_s(run) * rate)) / rate
    force = _at(run.force, time)
    place = point if point in plate.impact_points else plate.impact_points[0]
    simulated = respond(kept_below(plate, _BELOW * rate), force, 1 / rate, place, names)
    measured = np.array([_at(run.accelerations[name], time) for name in names])
    products = measured @ simulated.T
    sizes = np.linalg.norm(measured, axis=1), np.linalg.norm(simulated, axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        correlation = np.nan_to_num(products / np.outer(*sizes))
        log_gain = np.log(np.abs(np.diag(products)) / sizes[1] ** 2)
    return correlation, log_gain


def _span_s(run: Run) -> float:
    rise = run.force.time_s[np.argmax(run.force.values)] if run.force is not None and run.force.values.size else 0.0
    return max(EARLY_S, RISES * float(rise))


def _at(series: Series | None, time_s: Floats) -> Floats:
    """At other instants, less its rest before contact; nothing beyond its ends."""
    if series is None:
        return np.zeros(time_s.size)
    before = series.values[series.time_s < 0]
    rest = float(np.median(before)) if before.size else 0.0
    return np.interp(time_s, series.time_s, series.values - rest, left=0.0, right=0.0)
