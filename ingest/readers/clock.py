"""The sampling rate of each channel, from whatever the file says about it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from .base import AS_IN_FILE, ReadingOptions, RecordingError, refuse_bomb
from .contents import RATE_UNITS, TIME_UNITS, Array, Contents, time_scale, unit_in_time_name
from .even_time import UnevenTimeError, even_time
from .resampling import grid_rate

_AGREEMENT = 1e-3


@dataclass(frozen=True)
class Clock:
    """Rate and start of the channels below one group; `samples` is the length of its time vector,
    if it has one.

    `uneven_s` are the times of samples that are to be resampled at `rate_hz`.
    """

    rate_hz: float
    start_s: float = 0.0
    samples: int | None = None
    header: dict[str, Any] = field(default_factory=dict)
    uneven_s: Floats | None = None
    obstacle: str | None = (
        None  # why there is no rate: the channels of the group cannot be read, others can
    )


def positive_rate(path: Path, value: Any) -> float:
    """`value` as a sampling rate in hertz. Raises `RecordingError` unless it is one finite number
    above 0."""
    numbers = np.asarray(value)
    if numbers.size != 1 or numbers.dtype.kind not in "iuf":
        raise RecordingError(
            f"{path.name}: sampling rate is {value!r}; expected one number in hertz"
        )
    rate = float(numbers.reshape(-1)[0])
    if not math.isfinite(rate) or rate <= 0.0:
        raise RecordingError(
            f"{path.name}: sampling rate is {rate} Hz; expected a finite number above 0"
        )
    return rate


def clocks_of(
    path: Path, contents: Contents, options: ReadingOptions = AS_IN_FILE
) -> dict[str, Clock]:
    """The clock of every group that has one; the file's own statement is the clock of the root
    `""`.

    The rate that `options` give is that of a file that states none.
    """
    given_hz = options.sampling_rate_hz
    clocks: dict[str, Clock] = {}
    if contents.rate_hz is not None:
        clocks[""] = Clock(positive_rate(path, contents.rate_hz))
    for group in {array.group for array in contents.arrays if array.is_rate or array.is_time}:
        members = [array for array in contents.arrays if array.group == group]
        stated = clocks.get(group)
        for rate in (array for array in members if array.is_rate):
            stated = _agreeing(path, stated, Clock(_stated_rate(path, rate)))
        for time in (array for array in members if array.is_time):
            rate_hz = stated.rate_hz if stated is not None else given_hz
            try:
                stated = _agreeing(path, stated, _time_clock(path, time, rate_hz, options))
            except UnevenTimeError as error:
                stated = Clock(math.nan, obstacle=str(error).removeprefix(f"{path.name}: "))
                break
        if stated is not None:
            clocks[group] = stated
    if given_hz is not None:
        clocks.setdefault("", Clock(given_hz))
    return clocks


def clock_of_times(
    path: Path, times: Floats, unit_s: float = 1.0, options: ReadingOptions = AS_IN_FILE
) -> Clock:
    """The clock of times (n,) in units of `unit_s` seconds. Raises `RecordingError` where they rise
    unevenly and the laboratory does not ask to resample."""
    try:
        even = even_time(path, times, unit_s)
    except UnevenTimeError:
        if not options.resample_uneven_time:
            raise
        times_s = times * unit_s
        return Clock(grid_rate(path, times_s), float(times_s[0]), times.size, uneven_s=times_s)
    return Clock(
        even.rate_hz, even.start_s, times.size, {"time_gaps": even.gaps} if even.gaps else {}
    )


def refuse_other_rate(path: Path, clock: Clock, given_hz: float | None) -> None:
    """Raise `RecordingError` where the file's rate is another than the one that the laboratory
    gives for it."""
    if given_hz is not None and abs(clock.rate_hz - given_hz) > _AGREEMENT * given_hz:
        raise RecordingError(
            f"{path.name}: has a sampling rate of {clock.rate_hz} Hz, and {given_hz} Hz is given "
            "for it; correct or leave out the given rate (sampling_rate_hz under [recordings] in "
            "campaign.toml, --rate of a command)"
        )


def clocks_agree(first: Clock, second: Clock) -> bool:
    """Whether two clocks say one rate."""
    return bool(abs(first.rate_hz - second.rate_hz) <= _AGREEMENT * first.rate_hz)


def clock_above(clocks: dict[str, Clock], group: str) -> Clock | None:
    """The clock of `group` or of the nearest group above it."""
    while group and group not in clocks:
        group = group.rpartition("/")[0]
    return clocks.get(group)


def _agreeing(path: Path, stated: Clock | None, clock: Clock) -> Clock:
    """One clock of two statements: the first rate, the second start and length."""
    if stated is None:
        return clock
    if not clocks_agree(stated, clock):
        raise RecordingError(
            f"{path.name}: states two sampling rates, {stated.rate_hz} Hz and "
            f"{clock.rate_hz} Hz; expected one"
        )
    return replace(clock, rate_hz=stated.rate_hz, samples=stated.samples or clock.samples)


def _numbers(path: Path, array: Array) -> NDArray[np.float64]:
    if array.obstacle is not None:
        raise RecordingError(f"{path.name}: {array.name!r} {array.obstacle}")
    if (
        array.dtype.kind not in "iuf"
        or array.samples == 0
        or sum(length != 1 for length in array.shape) > 1
    ):
        raise RecordingError(
            f"{path.name}: {array.name!r} is {array.dtype} of shape "
            f"{array.shape}; expected numbers in a row or column"
        )
    refuse_bomb(path, array.name, array.samples, array.dtype.itemsize)
    return array.take(0, array.samples).astype(np.float64)


def _stated_rate(path: Path, array: Array) -> float:
    """A scalar `fs`, or a column that repeats it on every row."""
    values = _numbers(path, array)
    if np.any(values != values[0]):
        raise RecordingError(
            f"{path.name}: {array.name!r} varies from {values.min()} to "
            f"{values.max()}; expected one"
        )
    scale = RATE_UNITS.get((array.unit or "").lower())
    if scale is None:
        raise RecordingError(
            f"{path.name}: {array.name!r} is in {array.unit!r}; expected one of Hz, kHz, MHz"
        )
    return positive_rate(path, values[0] * scale)


def _time_clock(
    path: Path, array: Array, stated_hz: float | None, options: ReadingOptions
) -> Clock:
    """From a time vector; one printed with too few digits to tell its steps apart gives the start
    of a stated rate."""
    times = _numbers(path, array)
    scale = _epoch_unit(array, times) or time_scale(array.name, array.unit)
    if scale is None:
        raise RecordingError(
            f"{path.name}: {array.name!r} is in {array.unit!r}; expected one "
            f"of s, ms, us, ns, min, h"
        )
    try:
        return clock_of_times(path, times, scale, options)
    except RecordingError:
        if stated_hz is None or not rounded_from(times * scale, stated_hz):
            raise
    return Clock(stated_hz, float(times[0]) * scale, times.size, {"time_printed_coarsely": True})


#: Seconds since 1970 of the years 2001 to 2100.
_EPOCH_S = (1e9, 4.1e9)


def _epoch_unit(array: Array, times: NDArray[np.float64]) -> float | None:
    """Seconds per unit of a column without a unit whose numbers are dates: seconds, ms, us or ns
    since 1970."""
    if (array.unit and array.unit.strip()) or unit_in_time_name(array.name) is not None:
        return None
    low, high = _EPOCH_S
    units = (TIME_UNITS[unit] for unit in ("s", "ms", "us", "ns"))
    return next(
        (unit for unit in units if low <= times[0] * unit and times[-1] * unit <= high), None
    )


def rounded_from(times: NDArray[np.float64], rate_hz: float) -> bool:
    """Whether times (s) are those of even samples at `rate_hz`, each rounded to one and the same
    last digit."""
    steps = np.diff(times)
    if (
        steps.size == 0
        or not np.all(np.isfinite(times))
        or np.any(steps < 0)
        or not np.any(steps > 0)
    ):
        return False
    even = times[0] + np.arange(times.size) / rate_hz
    last_digit = float(np.min(steps[steps > 1e-9 * (times[-1] - times[0])]))
    return bool(np.max(np.abs(times - even)) <= 1.01 * last_digit)
