"""What an ingest refuses. Each fault is one line: file, row, column, value as a message shows it,
and what was expected."""

from __future__ import annotations

import datetime as dt
from collections.abc import Callable, Iterable, Sequence
from typing import ParamSpec, TypeVar, cast

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")

#: Faults that a message lists; of more it says how many.
MOST_LISTED = 20


class IngestError(ValueError):
    """The campaign cannot be ingested, and nothing of it was stored.

    `faults` has a line for each fault. The message is the only fault, or says how many there are
    and lists them below.
    """

    def __init__(self, *faults: str) -> None:
        super().__init__(*faults)
        self.faults = faults

    def __str__(self) -> str:
        if len(self.faults) == 1:
            return self.faults[0]
        files = " and ".join(dict.fromkeys(fault.partition(": ")[0] for fault in self.faults))
        more = (
            [f"and {len(self.faults) - MOST_LISTED} more"] if len(self.faults) > MOST_LISTED else []
        )
        lines = (" ".join(fault.split()) for fault in (*self.faults[:MOST_LISTED], *more))
        return "\n  ".join([f"{files}: {len(self.faults)} faults", *lines])


class Faults:
    """The faults of a folder's files, gathered so that one refusal names them all."""

    def __init__(self) -> None:
        self._faults: dict[str, None] = {}

    def attempt(
        self, read: Callable[Arguments, Result], *args: Arguments.args, **kwargs: Arguments.kwargs
    ) -> Result | None:
        """What a reading gives; None where it is refused, and its faults are kept.

        Parameters:
            read: The function that reads. It raises `IngestError` for what it refuses.
            args: Positional arguments of this function.
            kwargs: Keyword arguments of this function.
        """
        try:
            return read(*args, **kwargs)
        except IngestError as error:
            self.add(error.faults)
            return None

    def of(
        self, read: Callable[Arguments, Result], *args: Arguments.args, **kwargs: Arguments.kwargs
    ) -> Result:
        """`attempt` for a part of something larger, which nobody may use before `refuse`.

        Parameters:
            read: The function that reads. It raises `IngestError` for what it refuses.
            args: Positional arguments of this function.
            kwargs: Keyword arguments of this function.
        """
        return cast(Result, self.attempt(read, *args, **kwargs))

    def add(self, faults: Iterable[str]) -> None:
        """Keep faults; one that two readers meet counts once.

        Parameters:
            faults: One line for each fault.
        """
        self._faults |= dict.fromkeys(faults)

    def __bool__(self) -> bool:
        return bool(self._faults)

    def refuse(self) -> None:
        """Raise `IngestError` with all faults; nothing where there are none."""
        if self._faults:
            raise IngestError(*self._faults)


#: Longest name of a campaign, channel, factor or level: PostgreSQL indexes no text beyond 2.7 kB.
LONGEST_NAME = 500


def printable(value: object) -> str:
    """A value for a message, shortened.

    Parameters:
        value: Anything that a file held.

    Returns:
        The value as Python writes it, with at most 100 characters and an ellipsis.
    """
    try:
        text = repr(value)
    except ValueError:  # Python writes no whole number of more than 4300 digits
        return "a number of thousands of digits"
    return text if len(text) <= 100 else text[:100] + "…"


def parse_date(value: object, expected: str) -> dt.date:
    """A day that TOML holds as a date, a time or a text.

    Parameters:
        value: The value that TOML gave. A text is a date of ISO 8601, such as 2026-11-01.
        expected: What the message says that was expected.

    Raises:
        ValueError: For anything else, with the value and what was expected.
    """
    if isinstance(value, dt.datetime):
        return value.date()
    if isinstance(value, dt.date):
        return value
    try:
        return dt.date.fromisoformat(value if isinstance(value, str) else "")
    except ValueError as error:
        raise ValueError(f"{printable(value)}; expected {expected}") from error


def difference(name: str, given: str | None, stored: str | None) -> str:
    """How a message tells what a folder says and what the store holds.

    Parameters:
        name: What the two differ in, such as a key of campaign.toml.
        given: The value of the folder; None where it says nothing.
        stored: The value of the store; None where it says nothing.
    """
    absent = "not given"
    return (
        f"{name} is {absent if given is None else given}, "
        f"{absent if stored is None else stored} in the store"
    )


def enumerated(names: Sequence[str]) -> str:
    """Names one after another; of more than five the first, and how many more there are.

    Parameters:
        names: The names, in the order in which they are told.
    """
    return ", ".join(names[:5]) + (f" and {len(names) - 5} more" if len(names) > 5 else "")
