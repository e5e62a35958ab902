"""From a file's arrays to channels: the rules that hold for every format. Columns of a matrix are
named as the laboratory says, else `NAME_1`, `NAME_2`."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections import Counter
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from .base import (
    AS_IN_FILE,
    ChannelInfo,
    OpenRecording,
    Reader,
    ReadingOptions,
    RecordingError,
    refuse_bomb,
)
from .clock import (
    Clock,
    clock_above,
    clock_of_times,
    clocks_agree,
    clocks_of,
    positive_rate,
    refuse_other_rate,
)
from .contents import (
    Array,
    Contents,
    in_memory,
    name_and_unit,
    refuse_nothing,
    to_python,
    translate_errors,
)
from .even_time import UnevenTimeError
from .resampling import resampled
from .statements import obstacle_of, with_statements
from .unnamed_time import find_time_like, refuse_unnamed_time, with_times_by_unit

#: A matrix with more channels than this is no recording of a bench.
MAX_COLUMNS = 1024


def with_columns(path: Path, arrays: Sequence[Array], names: Sequence[str]) -> list[Array]:
    """`arrays` with every matrix in columns; a column named "" is left out.

    `names` are those of the matrix that has as many columns, or of the array that has no name.

    Samples run along the longer side, or across the side that has as many as there are names.
    Raises `RecordingError` where that is open.
    """
    fitting = [array for array in arrays if names and _fits(array, len(names))]
    if len(fitting) > 1:
        listed = ", ".join(repr(array.name) for array in fitting)
        raise RecordingError(
            f"{path.name}: {len(names)} columns are named, and {listed} have "
            f"as many; expected one matrix"
        )
    columns: list[Array] = []
    for array in arrays:
        if names and array.nameless and array not in fitting:
            raise RecordingError(
                f"{path.name}: {len(names)} columns are named ({', '.join(names)}), and its shape "
                f"is {array.shape}; expected as many names as columns"
            )
        columns += _columns(path, array, names if array in fitting else ())
    return columns


def _sides(array: Array) -> tuple[int, ...]:
    return tuple(length for length in array.shape if length != 1)


def _is_matrix(array: Array) -> bool:
    sides = _sides(array)
    return (
        len(sides) == 2
        and min(sides) > 0
        and array.dtype.kind in "iuf"
        and array.dtype.itemsize <= 8
    )


def _fits(array: Array, count: int) -> bool:
    if _is_matrix(array):
        return count in _sides(array)
    return array.nameless and count == 1 and len(_sides(array)) < 2


def _columns(path: Path, array: Array, names: Sequence[str]) -> list[Array]:
    if not _is_matrix(array):
        return [_renamed(array, names[0])] if names else [array]
    rows, columns = _sides(array)
    if rows == columns:
        if names or array.nameless:
            raise RecordingError(
                f"{path.name}: {array.name!r} has shape {array.shape}; "
                f"expected more samples than channels"
            )
        return [array]  # and refused when asked for: a calibration, perhaps
    across = columns < rows if not names else columns == len(names)
    count = columns if across else rows
    if count > MAX_COLUMNS:
        raise RecordingError(
            f"{path.name}: {array.name!r} has {count} columns; expected at most {MAX_COLUMNS}"
        )
    refuse_bomb(path, array.name, array.samples, array.dtype.itemsize)

    @cache
    def whole() -> NDArray[Any]:
        values = array.take(0, array.samples).reshape(rows, columns)
        return np.ascontiguousarray(values.T) if across else values

    labels = names or [f"{array.name}_{number + 1}" for number in range(count)]
    length = rows if across else columns

    def column(number: int, label: str) -> Array:
        def take(start: int, stop: int) -> NDArray[Any]:
            if whole().shape != (count, length):
                raise RecordingError(
                    f"{path.name}: {array.name!r} does not hold what it declares; it is damaged"
                )
            return whole()[number, start:stop].copy()

        return _renamed(replace(array, shape=(length,), take=take), label)

    return [column(number, label) for number, label in enumerate(labels) if label]


def _renamed(array: Array, label: str) -> Array:
    name, unit = name_and_unit(label)
    return replace(array, name=name, unit=unit or array.unit)


_KINDS = {
    "c": "complex",
    "O": "an object",
    "S": "text",
    "U": "text",
    "b": "logical",
    "V": "a structure",
}


class ArraysRecording(OpenRecording):
    """Channels over a file's arrays. An array that cannot be a channel is refused when asked for,
    not before."""

    def __init__(
        self, path: Path, contents: Contents, options: ReadingOptions = AS_IN_FILE
    ) -> None:
        self._path = path
        self._open_files: ExitStack | None = None
        self._arrays: dict[str, Array] = {}
        self._refused: dict[str, str] = {}
        self._name_by_place: dict[str, str] = {}
        contents = with_times_by_unit(contents)
        clocks, header, channels = clocks_of(path, contents, options), _header(contents), []
        refuse_unnamed_time(path, contents, options, clocks[""].rate_hz if "" in clocks else None)
        own_clock = _OwnClocks(path, options)
        for name, array in _named(path, contents.arrays):
            self._name_by_place |= dict.fromkeys(_channel_positions(array), name)
            beside = clock_above(clocks, array.group)
            clock = own_clock.of(array) or beside
            reason = _why_not(array, clock, beside)
            if clock is None:
                reason = f"{reason}{_hint(contents)}"
            if reason is None and contents.rules is not None:
                reason = obstacle_of(contents.rules, array, clock, options)
            if reason is not None or clock is None:
                self._refused[name] = reason or "has no sampling rate"
                continue
            refuse_bomb(path, name, array.samples, array.dtype.itemsize)
            if clock.uneven_s is None:
                refuse_other_rate(path, clock, options.sampling_rate_hz)
            else:
                array = _on_grid(path, array, clock, clock.uneven_s)
            self._arrays[name] = array
            channels.append(_info(name, array, clock, header))
        self.channels = tuple(channels)
        if not channels:
            raise RecordingError(f"{path.name}: {_nothing_found(self._refused)}")

    def hold(self, open_files: ExitStack) -> None:
        """Keep `open_files` until `close`."""
        self._open_files = open_files

    def info(self, name: str) -> ChannelInfo:
        if name not in self._arrays and name not in self._refused:
            name = self._name_by_place.get(name, name)
        if name in self._refused:
            raise RecordingError(f"{self._path.name}: {name!r} {self._refused[name]}")
        try:
            return super().info(name)
        except RecordingError as error:
            raise RecordingError(f"{self._path.name}: {error}") from None

    def names(self, name: str) -> bool:
        return name in self._refused or super().names(name)

    def read(self, name: str, start: int = 0, stop: int | None = None) -> NDArray[Any]:
        if self._open_files is None:
            raise RecordingError(f"{self._path.name}: is closed; open it again to read {name!r}")
        channel = self.info(name)
        first, last, _ = slice(start, stop).indices(channel.samples)
        wanted = max(0, last - first)
        with translate_errors(self._path):
            samples = self._arrays[channel.name].take(first, first + wanted)
            if samples.shape != (wanted,):
                raise RecordingError(
                    f"{self._path.name}: {name!r} gives {samples.size} "
                    f"samples from {first}; {wanted} were declared"
                )
            # Native byte order, and nothing else: an equal dtype is not copied.
            return samples.astype(channel.dtype, casting="equiv", copy=False)

    def close(self) -> None:
        if self._open_files is not None:
            self._open_files.close()
        self._open_files = None
        self._arrays = {}  # and the samples that some formats keep in memory


class ArrayReader(Reader):
    """A format whose own code is one function: the arrays of a file."""

    @abstractmethod
    def contents(self, path: Path, open_files: ExitStack, options: ReadingOptions) -> Contents:
        """The arrays of `path`; what must stay open for their `take` goes into `open_files`."""

    def open(self, path: Path, options: ReadingOptions = AS_IN_FILE) -> OpenRecording:
        path = Path(path)
        with translate_errors(path), ExitStack() as open_files:
            refuse_nothing(path)
            contents = self.contents(path, open_files, options)
            if contents.rules is not None:
                contents = with_statements(path, contents, options)
            contents = replace(
                contents, arrays=with_columns(path, contents.arrays, options.columns)
            )
            recording = ArraysRecording(path, contents, options)
            recording.hold(open_files.pop_all())
            return recording


def _named(path: Path, arrays: list[Array]) -> list[tuple[str, Array]]:
    """Everything but rates, times and scalars, by its name, or `group/name` where the name alone is
    not unique."""
    candidates = [a for a in arrays if not a.is_rate and not a.is_time and a.samples != 1]
    count = Counter(a.name for a in candidates)
    named = [
        (_text(f"{a.group}/{a.name}" if count[a.name] > 1 and a.group else a.name), a)
        for a in candidates
    ]
    for name, times in Counter(name for name, _ in named).items():
        if times > 1:
            raise RecordingError(
                f"{path.name}: has {times} channels called {name!r}; expected different names"
            )
    return named


def _channel_positions(array: Array) -> list[str]:
    """A channel by its place in the file, as HDF5 and as MATLAB write it: `bench/force`,
    `bench.force`."""
    return (
        [f"{array.group}/{array.name}", f"{array.group}.{array.name}".replace("/", ".")]
        if array.group
        else []
    )


def _text(text: str) -> str:
    """What can be printed and stored: libraries hand on bytes that are no UTF-8 as halves of
    characters."""
    return text.encode("utf-8", "replace").decode("utf-8")


class _OwnClocks:
    """The clocks of arrays that have their own; channels that share their times share a clock."""

    def __init__(self, path: Path, options: ReadingOptions) -> None:
        self._path, self._options = path, options
        self._by_times: dict[int, Clock] = {}

    def of(self, array: Array) -> Clock | None:
        if array.times_s is not None and array.obstacle is None:
            if id(array.times_s) not in self._by_times:
                self._by_times[id(array.times_s)] = self._clock(array.times_s)
            return self._by_times[id(array.times_s)]
        return (
            None
            if array.rate_hz is None
            else Clock(positive_rate(self._path, array.rate_hz), array.start_s)
        )

    def _clock(self, times_s: Floats) -> Clock:
        try:
            return clock_of_times(self._path, times_s, options=self._options)
        except UnevenTimeError as error:
            return Clock(math.nan, obstacle=str(error).removeprefix(f"{self._path.name}: "))


def _on_grid(path: Path, array: Array, clock: Clock, times_s: Floats) -> Array:
    """A channel of uneven times on the even grid of its clock, with the error of this in its
    header."""
    samples = array.take(0, array.samples).astype(np.float64)
    values, error = resampled(path, array.name, times_s, samples, clock.rate_hz)
    steps = np.diff(times_s)
    peak = float(np.max(np.abs(samples - np.median(samples))))
    facts = {
        "samples": array.samples,
        "shortest_step_s": float(steps.min()),
        "longest_step_s": float(steps.max()),
        "error_share_of_peak": error / peak if peak > 0.0 else 0.0,
    }
    return in_memory(
        array.name,
        values,
        group=array.group,
        unit=array.unit,
        header={**array.header, "resampled_time": facts},
    )


def _why_not(array: Array, clock: Clock | None, beside: Clock | None) -> str | None:
    """Why `array` cannot be a channel; None where it can."""
    if array.obstacle is not None:
        return array.obstacle
    if array.dtype.kind not in "iuf" or array.dtype.itemsize > 8:
        return (
            f"is {_KINDS.get(array.dtype.kind, array.dtype.name)}; expected real "
            f"numbers of at most 8 bytes"
        )
    if array.samples == 0:
        return "is empty; expected samples"
    if sum(length != 1 for length in array.shape) > 1:
        return f"has shape {array.shape}; expected one row or one column"
    if clock is None:
        return (
            "has no sampling rate; expected fs in hertz, or a time vector named t, time or time_s; "
            "campaign.toml can give sampling_rate_hz under [recordings]"
        )
    if clock.obstacle is not None:
        return f"cannot be read: {clock.obstacle}"
    if not math.isfinite(clock.start_s):
        return f"starts at {clock.start_s} s; expected a finite time"
    if clock.samples not in (None, array.samples):
        return f"has {array.samples} samples, its time vector {clock.samples}; expected as many"
    if beside is not None and beside.samples == array.samples and not clocks_agree(clock, beside):
        time = beside.obstacle or f"it gives {beside.rate_hz:g} Hz"
        return (
            f"states {clock.rate_hz:g} Hz, which the time beside it contradicts: "
            f"{time}; correct one of them"
        )
    return None


def _info(name: str, array: Array, clock: Clock, header: dict[str, Any]) -> ChannelInfo:
    unit = _text(array.unit).strip() if array.unit and array.unit.strip() else None
    return ChannelInfo(
        name=name,
        samples=array.samples,
        dtype=array.dtype.newbyteorder("=").str,
        sampling_rate_hz=clock.rate_hz,
        start_s=clock.start_s,
        unit=unit,
        header={**header, **clock.header, **array.header},
    )


def _hint(contents: Contents) -> str:
    like_time = find_time_like(contents.arrays)
    return (
        f"; {like_time[0]!r} rises evenly by {like_time[1]:.6g}: name it time if it is that"
        if like_time
        else ""
    )


def _header(contents: Contents) -> dict[str, Any]:
    """The file's own statements and its scalars."""
    scalars = [
        a for a in contents.arrays if a.samples == 1 and not a.is_rate and a.dtype.kind in "iuf"
    ]
    return {**contents.header, **{a.name: to_python(a.take(0, 1)) for a in scalars}}


def _nothing_found(refused: dict[str, str]) -> str:
    reasons = "; ".join(f"{name!r} {reason}" for name, reason in list(refused.items())[:4])
    return reasons or "holds no channel; expected vectors of samples and fs, or a time vector"
