"""Records of the tank's pressure of chosen shots, on a clock that begins when the projectile leaves
the barrel."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field

import numpy as np
from sqlalchemy.orm import Session

from ...array_types import Floats
from ...ingest.extraction.gunshot import laser_channel
from ...ingest.extraction.pressure_drop import PressureDrop, pressure_drop
from ...ingest.extraction.velocity import NoPassageError, muzzle_velocity
from ...ingest.storing.stored_channels import list_channels, read_channel
from ...signals.channel import Channel
from ..record import Series
from .series import QualityExclusions, StoredImpact

#: Set and recorded pressures that differ by no more, as a ratio, may be readings of one instrument.
_SAME_INSTRUMENT = 0.008
#: A gain and an offset are told apart from so many set pressures on.
_FEWEST_LEVELS = 3
#: Means over this time are what is kept: a tank changes by less than its transducer's noise
#: meanwhile.
_BLOCK_S = 0.5e-3
#: The trigger's moment of opening is known from so many records on, and no better than by this
#: deviation.
_FEWEST_OPENINGS, _LEAST_OPENING_S = 6, 1e-3
#: A level that is less certain than this share of itself says nothing beside the line.
_LARGEST_SHARE = 0.2


@dataclass(eq=False)
class TankPressures:
    """Records by a shot's place in the order of runs. `levels`: of shots without a recorded
    pressure, by place, what the record says of the pressure before the shot with its standard
    uncertainty, Pa, given that the valve opened as long after the trigger as in the others.
    `without_passage`: shots whose pressure was recorded, and whose laser shows no whole passage or
    is not there; `rejected`: those that a quality check said not to use."""

    traces: dict[int, Series] = field(default_factory=dict)
    levels: dict[int, tuple[float, float]] = field(default_factory=dict)
    without_passage: int = 0
    rejected: int = 0


def pressures_as_read(
    hits: Sequence[StoredImpact], levels: Mapping[int, tuple[float, float]] | None = None
) -> list[float | None]:
    """The pressure before each shot as the transducer reads it: recorded, or the set one where no
    shot was recorded.

    A regulator and a transducer may differ by a gain and an offset. Where some records show no
    pressure before the shot, what the transducer would have read follows from the others by a
    straight line through what was set and what was recorded: through the origin where fewer than
    three pressures were set. A transducer need not be straight: `levels`, as in `TankPressures`,
    count beside the line by their uncertainty and by what they say of the line's.
    """
    pairs = [(hit.set_pressure_pa, hit.recorded_pressure_pa) for hit in hits]
    pairs_pa = np.array(
        [(a, b) for a, b in pairs if a is not None and b is not None], dtype=np.float64
    ).reshape(-1, 2)
    if not pairs_pa.size:
        return [recorded if recorded is not None else nominal for nominal, recorded in pairs]
    slope, level = _line(pairs_pa[:, 0], pairs_pa[:, 1])
    positive = pairs_pa[:, 0] > 0
    deviations = pairs_pa[positive, 1] / (level + slope * pairs_pa[positive, 0]) - 1
    scatter = 1.4826 * float(np.median(np.abs(deviations))) if deviations.size else 0.0
    pressures_pa: list[float | None] = []
    for place, (nominal, recorded) in enumerate(pairs):
        if recorded is not None or nominal is None:
            pressures_pa.append(recorded)
            continue
        expected_pa = float(level + slope * nominal)
        record_level = (levels or {}).get(place)
        pressures_pa.append(
            expected_pa if record_level is None else _weighed(expected_pa, scatter, *record_level)
        )
    return pressures_pa


def _weighed(expected_pa: float, scatter: float, level_pa: float, level_u_pa: float) -> float:
    """The mean of the line's pressure and of the record's level by their variances. The line's is
    that of the scatter about it (a share), and what the level is farther from it than both
    explain."""
    variance, level_variance = (scatter * expected_pa) ** 2, level_u_pa**2
    variance += max((level_pa - expected_pa) ** 2 - variance - level_variance, 0.0)
    total = variance + level_variance
    return (expected_pa * level_variance + level_pa * variance) / total if total else level_pa


def pressures_set(hits: Sequence[StoredImpact]) -> list[float | None]:
    """What the regulator was set to, for shots whose pressure was recorded; None for all where the
    two differ by no more than `_SAME_INSTRUMENT` in the median: then the operator may have set the
    pressure by the transducer itself, and its errors do not show."""
    pairs = [(hit.set_pressure_pa, hit.recorded_pressure_pa) for hit in hits]
    log_ratios = [
        abs(np.log(read / nominal)) for nominal, read in pairs if nominal and read and read > 0
    ]
    if not log_ratios or float(np.median(log_ratios)) <= _SAME_INSTRUMENT:
        return [None] * len(hits)
    return [nominal if nominal and read else None for nominal, read in pairs]


def _line(nominal: Floats, recorded: Floats) -> tuple[float, float]:
    """Slope and level (Pa) of a straight line through most points (n,), Pa: medians by Theil and
    Sen of ratios over the inverse of the pressure: a regulator errs in proportion to it."""
    from scipy.stats import theilslopes

    positive = nominal > 0
    ratio, inverse = recorded[positive] / nominal[positive], 1 / nominal[positive]
    if np.unique(inverse).size < _FEWEST_LEVELS:
        return (float(np.median(ratio)) if ratio.size else 1.0), 0.0
    level, slope, *_ = theilslopes(ratio, inverse)
    return float(slope), float(level)


def read_tank_pressures(
    session: Session,
    hits: Sequence[StoredImpact],
    chosen: Sequence[int],
    exclusions: QualityExclusions,
) -> TankPressures:
    """Of the shots at the places `chosen`. Raises `schema.series.SeriesError` where a stored record
    is damaged."""
    result = TankPressures()
    lacks_pressures = any(hits[place].recorded_pressure_pa is None for place in chosen)
    drops: list[PressureDrop] = []
    without_rest: dict[int, Series] = {}
    for place in chosen:
        hit = hits[place]
        rows = list_channels(session, hit.recording_id or 0)
        tank = next((row for row in rows if row.quantity == "pressure"), None)
        if tank is None:
            continue
        lasers = [
            read_channel(session, row)
            for row in rows
            if row.quantity in ("displacement", "voltage")
        ]
        exit_s = _passage_s(laser_channel(lasers))
        if exclusions.rejects(hit, tank.name):
            result.rejected += 1
            continue
        channel = read_channel(session, tank)
        if hit.recorded_pressure_pa is None:
            without_rest[place] = _block_means(channel, channel.start_s)
        elif lacks_pressures:
            means = _block_means(channel, channel.start_s)
            with suppress(ValueError):  # once averaged, a drop may be too short to be seen again
                drops.append(pressure_drop(means.values, means.sampling_rate_hz))
        if exit_s is None:
            result.without_passage += 1
            continue
        trace = _block_means(channel, exit_s)
        if trace.values.size and np.isfinite(trace.values).all():
            result.traces[place] = trace
        else:
            result.rejected += 1
    result.levels = _levels(without_rest, drops)
    return result


def _levels(
    without_rest: Mapping[int, Series], drops: Sequence[PressureDrop]
) -> dict[int, tuple[float, float]]:
    """Levels before the shot with their standard uncertainties, Pa, by place: of records of the
    same trigger as those whose `drops` were seen. A slow drop in noise leaves open whether it
    begins before the record; that the valve of every shot opens as long after the trigger says that
    it does not."""
    if len(drops) < _FEWEST_OPENINGS:
        return {}
    moments_s = np.array([drop.time_s for drop in drops])
    opening_s = float(np.median(moments_s))
    spread_s = 1.4826 * float(np.median(np.abs(moments_s - opening_s)))
    opening = (
        opening_s,
        math.hypot(spread_s, _LEAST_OPENING_S, float(np.median([drop.time_u_s for drop in drops]))),
    )
    levels = {}
    for place, means in without_rest.items():
        with suppress(ValueError):  # the line through the others stands in for it
            drop = pressure_drop(means.values, means.sampling_rate_hz, opening)
            if drop.pressure_u_pa < _LARGEST_SHARE * drop.pressure_pa:
                levels[place] = drop.pressure_pa, drop.pressure_u_pa
    return levels


def _passage_s(laser: Channel | None) -> float | None:
    """The middle of the projectile's passage, on the recording's clock."""
    if laser is None:
        return None
    try:
        passage = muzzle_velocity(
            laser.readings, laser.sampling_rate_hz, 1.0
        )  # its length does not matter here
    except (
        NoPassageError,
        ValueError,
    ):  # the ingest has a finding of it, and the report counts such shots
        return None
    middle = (passage.enter_sample + passage.leave_sample) / 2
    return float(laser.start_s + middle / laser.sampling_rate_hz)


def _block_means(tank: Channel, exit_s: float) -> Series:
    block = max(1, round(_BLOCK_S * tank.sampling_rate_hz))
    count = tank.readings.size // block
    means = (
        np.asarray(tank.readings[: count * block], dtype=np.float64)
        .reshape(count, block)
        .mean(axis=1)
    )
    first_s = tank.start_s + (block - 1) / 2 / tank.sampling_rate_hz
    return Series(means, tank.sampling_rate_hz / block, first_s - exit_s)
