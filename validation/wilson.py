"""A share of cases with its uncertainty."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Self

#: Of the standard normal, for 95 %.
_Z = 1.959964


@dataclass(frozen=True)
class Rate:
    """`hits` of `n`, with the interval of 95 % after Wilson, J. Am. Stat. Assoc. 22 (1927) 209."""

    hits: int
    n: int

    @classmethod
    def of(cls, outcomes: Iterable[bool]) -> Self:
        flags = [bool(outcome) for outcome in outcomes]
        return cls(sum(flags), len(flags))

    @property
    def value(self) -> float | None:
        """None where there was no case."""
        return self.hits / self.n if self.n else None

    @property
    def interval(self) -> tuple[float, float]:
        return wilson(self.hits, self.n)

    def as_json(self) -> dict[str, Any]:
        low, high = self.interval
        return {"value": self.value, "low": low, "high": high, "n": self.n}


def wilson(hits: int, n: int) -> tuple[float, float]:
    """Ends of the interval; 0 and 1 without a case."""
    if not n:
        return 0.0, 1.0
    share, weight = hits / n, _Z**2 / n
    middle = (share + weight / 2) / (1 + weight)
    half = math.sqrt(share * (1 - share) * weight + weight**2 / 4) / (1 + weight)
    return max(0.0, middle - half), min(1.0, middle + half)
