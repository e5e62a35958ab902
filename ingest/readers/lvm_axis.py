"""The x axis of LVM channels: absolute starts, steps in their unit, and what the X column says of
gaps."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ...array_types import Floats
from .base import ReadingOptions, RecordingError, rate_from_step
from .clock import rounded_from
from .even_time import UnevenTimeError, even_time
from .file_fields import is_harmless
from .start_times import clock_zero, starts_on_one_clock
from .x_axis import seconds_per_unit_of_x

#: LabVIEW prints Delta_X with seven digits.
_PRINTED_STEP = 5e-7
#: Of Delta_X and the steps of the X column; the column's digits may hide more.
_AGREEMENT = 1e-3
#: `X0` above this are seconds since 1904 themselves.
_ABSOLUTE_S = 1e9
_DATE = re.compile(r"(\d{4})[/.-](\d{1,2})[/.-](\d{1,2})")
_TIME = re.compile(r"(\d{1,2}):(\d{2}):(\d{2})(?:[.,](\d*))?")


def channel_starts(
    path: Path, segment: Mapping[str, Any], count: int, options: ReadingOptions
) -> tuple[list[float | None], dict[str, str]]:
    """Seconds after the earliest `Date` and `Time` of the channels, None for a channel that alone
    has none; and the header that says what instant that is.

    Raises `RecordingError` for dates that differ and cannot be read.
    """
    dates, times = (_per_channel(segment, key, count) for key in ("Date", "Time"))
    stamps = list(zip(dates, times, strict=True))
    if is_harmless("Date", options) or is_harmless("Time", options):
        return [0.0] * count, {}
    try:
        starts = [_absolute(path, date, time) for date, time in stamps]
    except RecordingError:
        if len(set(stamps)) > 1:
            raise
        return [0.0] * count, {}
    return starts_on_one_clock(starts), clock_zero(starts)


def _absolute(path: Path, date: str, time: str) -> np.datetime64 | None:
    if not date and not time:
        return None
    day, clock = _DATE.fullmatch(date), _TIME.fullmatch(time)
    if day is None or clock is None:
        raise RecordingError(
            f"{path.name}: its channels start at different times, and {date!r} {time!r} is not "
            'read; expected yyyy/mm/dd and hh:mm:ss.sss, or harmless_fields = ["Date", "Time"] '
            "under [recordings] of campaign.toml (--harmless-field of a command) where all start "
            "together"
        )
    year, month, number = (int(word) for word in day.groups())
    hour, minute, second, fraction = clock.groups()
    nanoseconds = int((fraction or "0").ljust(9, "0")[:9])
    try:
        midnight = np.datetime64(f"{year:04d}-{month:02d}-{number:02d}", "ns")
    except ValueError as error:
        raise RecordingError(
            f"{path.name}: Date is {date!r}; expected a day as yyyy/mm/dd"
        ) from error
    since = (int(hour) * 60 + int(minute)) * 60 + int(second)
    return midnight + np.timedelta64(since, "s") + np.timedelta64(nanoseconds, "ns")


def _per_channel(segment: Mapping[str, Any], key: str, count: int) -> list[str]:
    """What a segment says for each channel; "" where it says nothing."""
    values = segment.get(key, [])
    values = [values] if isinstance(values, str) else list(values)
    return [str(value).strip() for value in (values + [""] * count)[:count]]


def channel_clock(
    path: Path,
    segment: Mapping[str, Any],
    channel: int,
    count: int,
    column: Floats | None,
    start_s: float | None,
) -> dict[str, Any]:
    """Rate, start, gaps or obstacle of a channel, as `Array` takes them, from `Delta_X` and `X0`
    and the X column.

    `column` are the X values of the channel's samples, where the file has them.
    """
    name, unit = (
        _per_channel(segment, key, count)[channel] for key in ("X_Dimension", "X_Unit_Label")
    )
    unit_s = seconds_per_unit_of_x(name, unit)
    if unit_s is None:
        return {
            "obstacle": f"has X_Dimension = {name!r} and X_Unit_Label = {unit!r}, which is no time "
            "in s, ms, us, ns, min or h; write the series over time"
        }
    if start_s is None:
        return {
            "obstacle": "has no Date and Time, and other channels have them: when it starts beside "
            'them is not known; harmless_fields = ["Date", "Time"] under [recordings] of '
            "campaign.toml (--harmless-field of a command) says that all channels start together"
        }
    step, offset = (_number(segment, key, channel) for key in ("Delta_X", "X0"))
    if offset is not None and abs(offset * unit_s) > _ABSOLUTE_S:
        return {
            "obstacle": f"has X0 = {offset}, an absolute time "
            f"beside Date and Time; write relative time"
        }
    if step is None:
        if column is None:
            raise RecordingError(
                f"{path.name}: has neither Delta_X nor an X column; expected one of them"
            )
        return {"times_s": column * unit_s + start_s}
    if not step > 0.0:
        raise RecordingError(
            f"{path.name}: Delta_X is {step} {unit or 's'}; expected a step above 0"
        )
    first_s = 0.0 if offset is None else offset * unit_s
    clock = {"rate_hz": rate_from_step(step * unit_s, _PRINTED_STEP), "start_s": first_s + start_s}
    return clock if column is None else _with_column(path, clock, column * unit_s, start_s)


def _number(segment: Mapping[str, Any], key: str, channel: int) -> float | None:
    values: Sequence[Any] = segment.get(key, [])
    return (
        float(values[channel]) if channel < len(values) and np.isfinite(values[channel]) else None
    )


def _with_column(
    path: Path, clock: dict[str, Any], times_s: Floats, start_s: float
) -> dict[str, Any]:
    """`Delta_X` beside an X column: gaps are the column's, and the two must agree."""
    rate_hz = clock["rate_hz"]
    try:
        even = even_time(path, times_s)
    except UnevenTimeError:
        return {"times_s": times_s + start_s}  # refused or resampled as any uneven time
    except RecordingError as error:
        if rounded_from(times_s, rate_hz):
            return clock
        return {"obstacle": f"has an X column that contradicts its Delta_X: {error}"}
    if abs(even.rate_hz - rate_hz) > _AGREEMENT * rate_hz and not rounded_from(times_s, rate_hz):
        return {
            "obstacle": f"has a Delta_X of {rate_hz:g} Hz, and its X column gives {even.rate_hz:g} "
            "Hz; correct one of them"
        }
    return {**clock, "header": {"time_gaps": even.gaps}} if even.gaps else clock
