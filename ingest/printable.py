"""Texts that a lab writes: how long a name may be, and how a message shows a value."""

from __future__ import annotations

import datetime as dt
from collections.abc import Sequence

#: Longest name of a campaign, channel, factor or level: PostgreSQL indexes no text beyond 2.7 kB.
LONGEST_NAME = 500


def shown(value: object) -> str:
    """A value for a message, shortened."""
    try:
        text = repr(value)
    except ValueError:  # Python writes no whole number of more than 4300 digits
        return "a number of thousands of digits"
    return text if len(text) <= 100 else text[:100] + "…"


def stated_day(value: object, expected: str) -> dt.date:
    """A day that TOML holds as a date, a time or a text. Raises `ValueError` with the value and what was expected."""
    if isinstance(value, dt.datetime):
        return value.date()
    if isinstance(value, dt.date):
        return value
    try:
        return dt.date.fromisoformat(value if isinstance(value, str) else "")
    except ValueError as error:
        raise ValueError(f"{shown(value)}; expected {expected}") from error


def difference(name: str, given: str | None, stored: str | None) -> str:
    """How a message tells what a folder says and what the store holds; None where one of them says nothing."""
    absent = "not given"
    return f"{name} is {absent if given is None else given}, {absent if stored is None else stored} in the store"


def enumerated(names: Sequence[str], most: int = 5) -> str:
    """Names one after another; of more than `most` the first, and how many more there are."""
    return ", ".join(names[:most]) + (f" and {len(names) - most} more" if len(names) > most else "")
