"""Absolute starts of channels on one clock: seconds after the earliest of them.

What instant that is stands in the header of the channels (`CLOCK_ZERO`), so that files of one shot
can be compared.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

#: Before this, a time stamp is LabVIEW's zero (1904) or a clock that was never set: no start.
_NEVER_SET = np.datetime64("1905-01-01", "ns")
CLOCK_ZERO = "clock_zero"
_SECOND = np.timedelta64(1_000_000_000, "ns")


def absolute_start(value: object) -> np.datetime64 | None:
    """A start as a file has it; None where it has none, or the zero of its clock."""
    if not isinstance(value, np.datetime64) or np.isnat(value):
        return None
    # 1904 is beyond what nanoseconds can hold together with today in other units: compare before
    # converting.
    return value.astype("M8[ns]") if value > _NEVER_SET.astype("M8[s]") else None


def parsed_instant(text: object) -> np.datetime64 | None:
    """The instant of a header; None for anything else."""
    try:
        return np.datetime64(text, "ns") if isinstance(text, str) else None
    except ValueError:
        return None


def seconds_between(first: np.datetime64, second: np.datetime64) -> float:
    """From `first` to `second`, exact to the nanosecond."""
    return float((second.astype("M8[ns]") - first.astype("M8[ns]")) / _SECOND)


def starts_on_one_clock(starts: Sequence[np.datetime64 | None]) -> list[float | None]:
    """Seconds after the earliest of `starts`; None for a start that cannot be compared, as the
    others have one.

    Where no channel has an absolute start, all begin together.
    """
    stated = [start for start in starts if start is not None]
    if not stated:
        return [0.0] * len(starts)
    origin = min(stated)
    return [None if start is None else seconds_between(origin, start) for start in starts]


def clock_zero(starts: Sequence[np.datetime64 | None]) -> dict[str, str]:
    """The header that says at which instant `start_s` is 0; empty where no channel has an absolute
    start."""
    stated = [start for start in starts if start is not None]
    return {CLOCK_ZERO: str(min(stated))} if stated else {}
