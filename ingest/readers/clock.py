"""The sampling rate of each channel, from whatever the file says about it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .base import RecordingError, rate_from_times, refuse_bomb
from .contents import RATE_UNITS, Array, Contents, time_scale

_AGREEMENT = 1e-3


@dataclass(frozen=True)
class Clock:
    """Rate and start of the channels below one group; `samples` is the length of its time vector, if it has one."""

    rate_hz: float
    start_s: float = 0.0
    samples: int | None = None
    header: dict[str, Any] = field(default_factory=dict)


def positive_rate(path: Path, value: Any) -> float:
    """`value` as a sampling rate in hertz. Raises `RecordingError` unless it is one finite number above 0."""
    numbers = np.asarray(value)
    if numbers.size != 1 or numbers.dtype.kind not in "iuf":
        raise RecordingError(f"{path.name}: sampling rate is {value!r}; expected one number in hertz")
    rate = float(numbers.reshape(-1)[0])
    if not math.isfinite(rate) or rate <= 0.0:
        raise RecordingError(f"{path.name}: sampling rate is {rate} Hz; expected a finite number above 0")
    return rate


def clocks_of(path: Path, contents: Contents, given_hz: float | None = None) -> dict[str, Clock]:
    """The clock of every group that has one; the file's own statement is the clock of the root `""`.

    `given_hz` is the rate of a file that states none.
    """
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
            stated = _agreeing(path, stated, _time_clock(path, time, rate_hz))
        if stated is not None:
            clocks[group] = stated
    if given_hz is not None:
        clocks.setdefault("", Clock(given_hz))
    return clocks


def refuse_other_rate(path: Path, clock: Clock, given_hz: float | None) -> None:
    """Raise `RecordingError` where the file's rate is another than the one that the laboratory gives for it."""
    if given_hz is not None and abs(clock.rate_hz - given_hz) > _AGREEMENT * given_hz:
        raise RecordingError(
            f"{path.name}: has a sampling rate of {clock.rate_hz} Hz, and {given_hz} Hz is given for it; correct "
            "or leave out the given rate (sampling_rate_hz under [recordings] in campaign.toml, --rate of a command)"
        )


def clock_above(clocks: dict[str, Clock], group: str) -> Clock | None:
    """The clock of `group` or of the nearest group above it."""
    while group and group not in clocks:
        group = group.rpartition("/")[0]
    return clocks.get(group)


def _agreeing(path: Path, stated: Clock | None, clock: Clock) -> Clock:
    """One clock of two statements: the first rate, the second start and length."""
    if stated is None:
        return clock
    if abs(stated.rate_hz - clock.rate_hz) > _AGREEMENT * stated.rate_hz:
        raise RecordingError(
            f"{path.name}: states two sampling rates, {stated.rate_hz} Hz and {clock.rate_hz} Hz; expected one"
        )
    return Clock(stated.rate_hz, clock.start_s, stated.samples or clock.samples, clock.header)


def _numbers(path: Path, array: Array) -> NDArray[np.float64]:
    if array.dtype.kind not in "iuf" or array.samples == 0 or sum(length != 1 for length in array.shape) > 1:
        raise RecordingError(
            f"{path.name}: {array.name!r} is {array.dtype} of shape {array.shape}; expected numbers in a row or column"
        )
    refuse_bomb(path, array.name, array.samples, array.dtype.itemsize)
    return array.take(0, array.samples).astype(np.float64)


def _stated_rate(path: Path, array: Array) -> float:
    """A scalar `fs`, or a column that repeats it on every row."""
    values = _numbers(path, array)
    if np.any(values != values[0]):
        raise RecordingError(f"{path.name}: {array.name!r} varies from {values.min()} to {values.max()}; expected one")
    scale = RATE_UNITS.get((array.unit or "").lower())
    if scale is None:
        raise RecordingError(f"{path.name}: {array.name!r} is in {array.unit!r}; expected one of Hz, kHz, MHz")
    return positive_rate(path, values[0] * scale)


def _time_clock(path: Path, array: Array, stated_hz: float | None) -> Clock:
    """From a time vector; one printed with too few digits to tell its steps apart gives the start of a stated rate."""
    scale = time_scale(array.name, array.unit)
    if scale is None:
        raise RecordingError(f"{path.name}: {array.name!r} is in {array.unit!r}; expected one of s, ms, us, ns, min, h")
    times = _numbers(path, array) * scale
    try:
        rate, start = rate_from_times(path, times)
    except RecordingError:
        if stated_hz is None or not _rounded_from(times, stated_hz):
            raise
        return Clock(stated_hz, float(times[0]), times.size, {"time_printed_coarsely": True})
    return Clock(rate, start, times.size, time_gaps(np.diff(times) * rate))


def _rounded_from(times: NDArray[np.float64], rate_hz: float) -> bool:
    """Whether times (s) are those of even samples at `rate_hz`, each rounded to one and the same last digit."""
    steps = np.diff(times)
    if steps.size == 0 or not np.all(np.isfinite(times)) or np.any(steps < 0) or not np.any(steps > 0):
        return False
    even = times[0] + np.arange(times.size) / rate_hz
    last_digit = float(np.min(steps[steps > 1e-9 * (times[-1] - times[0])]))
    return bool(np.max(np.abs(times - even)) <= 1.01 * last_digit)


def time_gaps(steps: NDArray[np.float64]) -> dict[str, Any]:
    """`time_gaps`: [sample, missing samples before it] wherever a step (in samples) skips some.

    Samples are handed on as evenly spaced: what the time vector says beyond that must not be lost.
    """
    after = np.flatnonzero(steps > 1.5)
    if not after.size:
        return {}
    return {"time_gaps": [[int(i) + 1, round(float(steps[i])) - 1] for i in after]}
