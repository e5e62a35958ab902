"""Whether probabilities mean what they say. p are those of what was said (n,), `right` whether it was so (n,)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..array_types import Floats
from .case_results import CaseResult
from .wilson import Rate

#: Bins of the reliability curve, equally wide.
BINS = 10
#: A probability of zero for what was true costs as much as this one.
LEAST = 1e-6


@dataclass(frozen=True)
class Bin:
    """Answers of about the same probability: its mean, and how many were right."""

    probability: float
    right: Rate

    def as_json(self) -> dict[str, Any]:
        return {"probability": self.probability, **self.right.as_json()}


def curve(p: Floats, right: Floats, bins: int = BINS) -> tuple[Bin, ...]:
    """Of the bins that have an answer."""
    place = np.minimum((np.asarray(p) * bins).astype(int), bins - 1)
    hits = np.asarray(right, dtype=bool)
    return tuple(
        Bin(float(np.mean(np.asarray(p)[place == b])), Rate.of(hits[place == b])) for b in range(bins) if b in place
    )


def calibration_error(p: Floats, right: Floats, bins: int = BINS) -> float:
    """ECE: mean distance of the curve from the diagonal, weighed by answers. It is never below 0: with n answers in b
    bins a perfect forecaster has about sqrt(b / n) / 3. NaN without answers."""
    if not len(p):
        return math.nan
    parts = curve(p, right, bins)
    return sum(part.right.n * abs(part.probability - (part.right.value or 0.0)) for part in parts) / len(p)


def negative_log(rows: Sequence[CaseResult]) -> float:
    """Mean of -ln of the probability that the truth was given; NaN without rows."""
    costs = [-math.log(max(row.said.probability(row.label.accepted), LEAST)) for row in rows]
    return float(np.mean(costs)) if costs else math.nan


def brier(rows: Sequence[CaseResult]) -> float:
    """Mean over rows of the squared distance from the truth, summed over labels: 0 to 2; NaN without rows."""
    return float(np.mean([_squared(row) for row in rows])) if rows else math.nan


def label_set(probabilities: dict[str, float], level: float = 0.9) -> tuple[str, ...]:
    """The fewest labels that together have `level` of the probability, or all there are."""
    falling = sorted(probabilities, key=lambda label: -probabilities[label])
    total = np.cumsum([probabilities[label] for label in falling])
    return tuple(falling[: int(np.searchsorted(total, level - 1e-9)) + 1])


def _squared(row: CaseResult) -> float:
    accepted = row.label.accepted
    wrong = sum(p**2 for label, p in row.said.probabilities.items() if label not in accepted)
    return wrong + (1.0 - row.said.probability(accepted)) ** 2
