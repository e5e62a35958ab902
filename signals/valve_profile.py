"""The valve's position over time, as its controller is set: opening, holding and closing."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Self

from ..files.delimited_text import HeadedTable, decode_utf8, parse_number, table_rows

#: What the controller of the thesis's valve allows (section 2.1.2).
SHORTEST_OPENING_S, LONGEST_OPENING_S = 0.1, 30.0
#: Of a file with a profile.
COLUMNS = ("time_s", "valve_position")
_MOST_POINTS = 1000


@dataclass(frozen=True)
class ValveProfile:
    """Position of a ball valve over time: 0 is shut, 1 is a quarter turn further and open, straight
    lines in between.

    Times (k,) are in seconds from the trigger and rise; before the first point the valve has its
    position, after the last one the last. What area a position leaves open is the law of the valve,
    and no part of the profile. Raises `ValueError` for no or more than 1,000 points, times that do
    not rise, and positions outside of 0 to 1.
    """

    time_s: tuple[float, ...]
    position: tuple[float, ...]

    def __post_init__(self) -> None:
        if not 0 < len(self.time_s) <= _MOST_POINTS or len(self.time_s) != len(self.position):
            raise ValueError(
                f"valve profile: {len(self.time_s)} times and {len(self.position)} positions; "
                f"expected as many of both, 1 to {_MOST_POINTS}"
            )
        for time, position in zip(self.time_s, self.position, strict=True):
            if not 0 <= time < math.inf:
                raise ValueError(f"valve profile: time {time!r} s; expected 0 or more, finite")
            if not 0 <= position <= 1:
                raise ValueError(
                    f"valve profile: position {position!r} at "
                    f"{time:g} s; expected 0 (shut) to 1 (open)"
                )
        for first, second in pairwise(self.time_s):
            if not first < second:
                raise ValueError(
                    f"valve profile: {second:g} s after {first:g} s; expected times that rise"
                )

    @classmethod
    def of_controller(
        cls,
        opening_time_s: float,
        closing_start_s: float | None = None,
        closing_time_s: float | None = None,
    ) -> Self:
        """Evenly open within `opening_time_s`; from `closing_start_s` on evenly shut within
        `closing_time_s`.

        The closing takes as long as the opening where its time is not given; a valve that is told
        to close while it opens turns back from where it is. Raises `ValueError` for times that are
        not positive.
        """
        back_s = opening_time_s if closing_time_s is None else closing_time_s
        for name, value in (("opening_time_s", opening_time_s), ("closing_time_s", back_s)):
            if not 0 < value < math.inf:
                raise ValueError(f"{name} = {value!r}: expected a positive time")
        if closing_start_s is None:
            return cls((0.0, opening_time_s), (0.0, 1.0))
        if not 0 < closing_start_s < math.inf:
            raise ValueError(f"closing_start_s = {closing_start_s!r}: expected a positive time")
        reached = min(closing_start_s / opening_time_s, 1.0)
        points = [(0.0, 0.0), (closing_start_s, reached), (closing_start_s + reached * back_s, 0.0)]
        if closing_start_s > opening_time_s:
            points.insert(1, (opening_time_s, 1.0))
        return cls(*zip(*points, strict=True))

    @classmethod
    def parse(cls, text: str) -> Self:
        """Of "0:0 0.1:1 0.4:1 0.5:0", each point as time in s and position, commas or blanks in
        between.

        Raises `ValueError` quoting the point that is not understood.
        """
        points = []
        for part in text.replace(",", " ").split() or [text]:
            time, _, position = part.partition(":")
            try:
                points.append((float(time), float(position)))
            except ValueError:
                raise ValueError(
                    f"valve profile {text!r}: point {part!r}; expected TIME:POSITION in s and 0 "
                    "(shut) to 1 (open), such as '0:0 0.1:1'"
                ) from None
        return cls(*zip(*points, strict=True))

    @classmethod
    def read(cls, path: Path) -> Self:
        """Of a CSV file with the columns `time_s` and `valve_position`. Raises `ValueError` naming
        line and value."""
        try:
            table = HeadedTable.of(table_rows(decode_utf8(path.read_bytes())))
            table.check()
        except OSError as error:
            raise ValueError(f"valve profile {path}: cannot be read: {error.strerror}") from error
        except ValueError as error:
            raise ValueError(f"valve profile {path}: {error}") from error
        if not set(COLUMNS) <= set(table.header):
            raise ValueError(
                f"valve profile {path}: columns {table.header}; expected {', '.join(COLUMNS)}"
            )
        points = []
        for line, cells in table.lines:
            try:
                points.append(tuple(parse_number(cells[name]) for name in COLUMNS))
            except ValueError:
                raise ValueError(
                    f"valve profile {path}: line {line}: expected two numbers"
                ) from None
        if not points:
            raise ValueError(f"valve profile {path}: no rows; expected at least one point")
        return cls(*zip(*points, strict=True))

    def __str__(self) -> str:
        """As `parse` reads it back."""
        return " ".join(
            f"{time:.12g}:{place:.12g}"
            for time, place in zip(self.time_s, self.position, strict=True)
        )
