"""Arrays that are time, or may be, without being called so: by their unit, or as they rise
evenly."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from itertools import groupby
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from .base import ReadingOptions, RecordingError
from .contents import TIME_UNITS, Array, Contents
from .file_fields import is_harmless

#: Samples that are looked at first: hardly any channel rises evenly through so many.
_PROBE = 16
_FEWEST = 8
#: Of a step from the mean step, beyond the printed digits of a column; and of a rate from the
#: inverse step.
_EVEN, _AGREEMENT = 0.3, 1e-2


def with_times_by_unit(contents: Contents) -> Contents:
    """`contents` in which the one array of a group that rises and is in s, ms or their like is its
    time, if none is."""
    arrays = []
    for _, members in groupby(contents.arrays, key=lambda array: array.group):
        group = list(members)
        by_unit = (
            []
            if any(array.is_time for array in group)
            else [a for a in group if _is_time_by_unit(a)]
        )
        if len(by_unit) == 1:
            group = [replace(a, rises_as_time=True) if a is by_unit[0] else a for a in group]
        arrays += group
    return replace(contents, arrays=arrays)


def _is_time_by_unit(array: Array) -> bool:
    unit = (array.unit or "").strip().lower()
    return unit in TIME_UNITS and _rises(array) is not None


def _rises(array: Array) -> NDArray[np.float64] | None:
    """The samples of an array that rises at every one of them; None for any other."""
    one_row = sum(length != 1 for length in array.shape) == 1
    if (
        array.dtype.kind not in "iuf"
        or array.dtype.itemsize > 8
        or not one_row
        or array.samples < _FEWEST
    ):
        return None
    if not np.all(np.diff(array.take(0, min(_PROBE, array.samples)).astype(np.float64)) > 0):
        return None
    samples = array.take(0, array.samples).astype(np.float64)
    return samples if np.all(np.diff(samples) > 0) else None


def find_time_like(arrays: Iterable[Array]) -> tuple[str, float] | None:
    """Name and step of the first array of a file, where it rises evenly as time does and does not
    just count."""
    array = next((a for a in arrays if not a.is_rate and a.samples != 1), None)
    samples = None if array is None or array.is_time else _rises(array)
    if array is None or samples is None:
        return None
    steps = np.diff(samples)
    step = float(np.mean(steps))
    counts = bool(np.all(steps == steps[0]) and step == round(step))
    uneven = float(np.mean(np.abs(steps - step) > _EVEN * step))
    return None if counts or uneven > 0.1 else (array.name, step)


def refuse_unnamed_time(
    path: Path, contents: Contents, options: ReadingOptions, rate_hz: float | None
) -> None:
    """Raise `RecordingError` where a rate is stated and an array rises as the time of another rate
    would.

    Names that the laboratory gives to columns are taken as they are.
    """
    if rate_hz is None or options.columns or any(array.is_time for array in contents.arrays):
        return
    like_time = find_time_like(contents.arrays)
    if like_time is None or is_harmless(like_time[0], options):
        return
    name, step = like_time
    if any(
        abs(1.0 / (step * unit) - rate_hz) <= _AGREEMENT * rate_hz
        for unit in set(TIME_UNITS.values())
    ):
        return
    raise RecordingError(
        f"{path.name}: {name!r} rises evenly by {step:.6g}, as time does, which is not the step of "
        f'{rate_hz:g} Hz; if it is time, name it so with its unit (columns = ["time [ms]", ...] '
        "under [recordings] of campaign.toml) and leave out the rate; if it is none, write "
        f'harmless_fields = ["{name}"] (--harmless-field of a command)'
    )
