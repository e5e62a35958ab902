"""How far the gap shrank, beside what the right effect would have done."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from .case_results import CaseResult
from .wilson import Rate

#: An oracle that shrinks the gap by less has nothing to be compared with.
_LEAST = 0.05


@dataclass(frozen=True)
class Shrunk:
    """`ratio` of the share that was removed to the share that the right effect removes: its median and 10th percentile.

    `covered` counts intervals that hold the true share, where it is known.
    """

    ratio_median: float
    ratio_10: float
    fraction_median: float
    n: int
    covered: Rate

    def as_json(self) -> dict[str, Any]:
        return {**vars(self), "covered": self.covered.as_json()}


def shrunk(rows: Sequence[CaseResult]) -> Shrunk:
    """Over the rows whose oracle found a gap to shrink. A report without a share counts as 0: nothing was removed."""
    held = [row for row in rows if (_fraction(row.oracle) or 0.0) > _LEAST]
    reported = np.array([_fraction(row.said.shrinkage) or 0.0 for row in held])
    best = np.array([_fraction(row.oracle) for row in held], dtype=np.float64)
    if not held:
        return Shrunk(math.nan, math.nan, math.nan, 0, covered(rows))
    ratio = reported / best
    return Shrunk(
        float(np.median(ratio)),
        float(np.percentile(ratio, 10)),
        float(np.median(reported)),
        len(held),
        covered(rows),
    )


def covered(rows: Sequence[CaseResult]) -> Rate:
    """How often the interval of 90 % holds the oracle's `true_fraction`, where both are given."""
    return Rate.of(
        bool(interval[0] <= row.oracle["true_fraction"] <= interval[1])
        for row in rows
        if row.oracle and row.oracle.get("true_fraction") is not None
        for interval in [(row.said.shrinkage or {}).get("ci90")]
        if interval
    )


def _fraction(entry: object) -> float | None:
    value = entry.get("fraction") if isinstance(entry, dict) else None
    return None if value is None else float(value)
