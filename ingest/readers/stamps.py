"""Times that a file holds as dates or as durations, in seconds."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .contents import Array


def as_time(array: Array) -> Array:
    """An array of dates or durations that is time by its name, in seconds: dates from the first one
    on, exactly, as no float could hold them to the microsecond otherwise. Any other array as it
    is."""
    if array.dtype.kind not in "mM" or not array.is_time or array.dtype == array.dtype.type:
        return array

    def take(start: int, stop: int) -> NDArray[Any]:
        values = array.take(0, array.samples)
        if array.dtype.kind == "M":
            values = values - values[:1]
        return seconds_of(values)[start:stop]

    return replace(array, dtype=np.dtype(np.float64), take=take, unit="s")


def seconds_of(durations: NDArray[Any]) -> NDArray[np.float64]:
    """Durations (n,) of any unit up to days, in seconds; one that is none ("NaT") is NaN."""
    nanoseconds = durations.astype("m8[ns]")
    seconds = nanoseconds.astype(np.int64) / 1e9
    seconds[np.isnat(nanoseconds)] = np.nan
    return np.asarray(seconds, dtype=np.float64)
