"""Clock and calendar times in text: `12:03:45.000010`, `2024-05-01T12:03:45.00001Z`, a date beside
a time of day.

Times become seconds since the first sample, exactly: at 1.7e9 s since 1970 a float64 has steps of
0.24 µs.
"""

from __future__ import annotations

import datetime as dt
import re
from collections.abc import Sequence
from fractions import Fraction
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

_DAY_S = 86400
#: A clock without a date that falls by more than this has passed midnight.
_MIDNIGHT_S = _DAY_S // 2
_CLOCK = r"(\d{1,2}):(\d{2})(?::(\d{2}))?(?:[.,](\d{1,18}))?(?: ?([AaPp])\.?[Mm]\.?)?"
_ZONE = r" ?(?:Z|UTC|([-+]\d{2}):?(\d{2})?)?"
_DATE = r"(?:(\d{4})([-/.])(\d{1,2})\2(\d{1,2})|(\d{1,2})([-/.])(\d{1,2})\6(\d{4}))"
_BEGINS_AS_CLOCK = re.compile(r"\d{1,2}:\d{2}|\d{1,4}([-/.])\d{1,2}\1\d", re.ASCII)
_CLOCK_ONLY = re.compile(_CLOCK + _ZONE, re.ASCII)
_DATE_ONLY = re.compile(_DATE, re.ASCII)
_BOTH = re.compile(f"{_DATE}(?:T| +){_CLOCK}{_ZONE}", re.ASCII)


def is_clock_text(text: str) -> bool:
    """Whether a cell is a date, a time of day, or both."""
    if not _BEGINS_AS_CLOCK.match(text):
        return False
    return any(pattern.fullmatch(text) for pattern in (_CLOCK_ONLY, _DATE_ONLY, _BOTH))


def is_date_text(text: str) -> bool:
    """Whether a cell is a date without a time of day."""
    return _DATE_ONLY.fullmatch(text) is not None


def elapsed_seconds(
    cells: Sequence[str], dates: Sequence[str] | None = None
) -> NDArray[np.float64]:
    """Seconds since the first cell (n,), of times of day or of dates with times; `dates` may stand
    in a column beside.

    A UTC offset is taken off; without one the clock is taken as it is, so that a change to summer
    time is a step of an hour. Times of day without a date go on over midnight. Raises `ValueError`
    naming the line of a cell that is none of these, and where the order of day and month is open
    and matters.
    """
    clocks = [cell.strip() for cell in cells]
    both = bool(clocks) and _BOTH.fullmatch(clocks[0]) is not None
    pattern = _BOTH if both else _CLOCK_ONLY
    matches = []
    for number, clock in enumerate(clocks, 1):
        match = pattern.fullmatch(clock)
        if match is None:
            raise ValueError(
                f"line {number} of the samples has the time {clock!r}; "
                f"expected one such as {clocks[0]!r}"
            )
        matches.append(match)
    offset = 8 if both else 0
    seconds = [_second_of_day(match, offset) for match in matches]
    if both:
        days = _days([match.groups()[:8] for match in matches])
    elif dates is not None:
        days = _days([_date_groups(number, date.strip()) for number, date in enumerate(dates, 1)])
    else:
        days = _counted_days(seconds)
    moments = [_DAY_S * day + second for day, second in zip(days, seconds, strict=True)]
    return np.array([float(moment - moments[0]) for moment in moments])


def _second_of_day(match: re.Match[str], offset: int) -> int | Fraction:
    hour, minute, second, fraction, half, zone_hours, zone_minutes = match.groups()[
        offset : offset + 7
    ]
    if second is None and fraction is not None:  # minutes and seconds, as Excel shows them
        hour, minute, second = "0", hour, minute
    hours, minutes, whole = int(hour), int(minute), int(second or 0)
    if half:
        hours = hours % 12 + (12 if half in "Pp" else 0)
    if hours > 24 or minutes > 59 or whole > 60:
        raise ValueError(f"{match.group()!r} is no time of day")
    total = 3600 * hours + 60 * minutes + whole
    if zone_hours:
        sign = -1 if zone_hours.startswith("-") else 1
        total -= sign * (3600 * abs(int(zone_hours)) + 60 * int(zone_minutes or 0))
    return total + Fraction(int(fraction), 10 ** len(fraction)) if fraction else total


def _date_groups(number: int, text: str) -> tuple[str | None, ...]:
    match = _DATE_ONLY.fullmatch(text)
    if match is None:
        raise ValueError(
            f"line {number} of the samples has the date {text!r}; expected one such as 2024-05-01"
        )
    return match.groups()


def _days(groups: list[tuple[str | None, ...]]) -> list[int]:
    """Days since the first date. Day and month may stand in either order where it does not
    matter."""
    meanings: list[list[int]] = []
    for month_first in (False, True):
        try:
            ordinals = {group: _date(group, month_first).toordinal() for group in set(groups)}
        except ValueError:
            continue
        days = [ordinals[group] - ordinals[groups[0]] for group in groups]
        if days not in meanings:
            meanings.append(days)
    steady = [
        days
        for days in meanings
        if all(after - before in (0, 1) for before, after in pairwise(days))
    ]
    chosen = steady or meanings
    if len(chosen) != 1:
        first, last = (
            "/".join(part for part in group if part and part.isdigit())
            for group in (groups[0], groups[-1])
        )
        raise ValueError(
            f"the dates from {first} to {last} can be read in two ways or none; expected 2024-05-01"
        )
    return chosen[0]


def _date(group: tuple[str | None, ...], month_first: bool) -> dt.date:
    year, _, month, day, first, _, second, last_year = (part or "" for part in group)
    if year:
        return dt.date(int(year), int(month), int(day))
    return dt.date(
        int(last_year), *((int(first), int(second)) if month_first else (int(second), int(first)))
    )


def _counted_days(seconds: Sequence[int | Fraction]) -> list[int]:
    days, day = [], 0
    for number, second in enumerate(seconds):
        day += number > 0 and second - seconds[number - 1] < -_MIDNIGHT_S
        days.append(day)
    return days
