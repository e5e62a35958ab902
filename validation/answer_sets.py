"""Which of the answers are right: pure functions of rows.

Whether an answer names where the gap lies.

Whether probabilities mean what they say. p are those of what was said (n,), `right` whether it was
so (n,).

A share of cases with its uncertainty.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from ..array_types import Floats
from ..diagnosis.verdict import NONE, UNKNOWN
from .case_results import CaseAnswer, CaseResult

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
        Bin(float(np.mean(np.asarray(p)[place == b])), Rate.of(hits[place == b]))
        for b in range(bins)
        if b in place
    )


def calibration_error(p: Floats, right: Floats, bins: int = BINS) -> float:
    """ECE: mean distance of the curve from the diagonal, weighed by answers. It is never below 0:
    with n answers in b bins a perfect forecaster has about sqrt(b / n) / 3. NaN without answers."""
    if not len(p):
        return math.nan
    parts = curve(p, right, bins)
    return sum(
        part.right.n * abs(part.probability - (part.right.value or 0.0)) for part in parts
    ) / len(p)


def negative_log(rows: Sequence[CaseResult]) -> float:
    """Mean of -ln of the probability that the truth was given; NaN without rows."""
    costs = [-math.log(max(row.said.probability(row.label.accepted), LEAST)) for row in rows]
    return float(np.mean(costs)) if costs else math.nan


def brier(rows: Sequence[CaseResult]) -> float:
    """Mean over rows of the squared distance from the truth, summed over labels: 0 to 2; NaN
    without rows."""
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


Rows = Sequence[CaseResult]


def singles(rows: Rows) -> list[CaseResult]:
    """One effect of the catalogue, with a gap beyond tolerance."""
    return [row for row in rows if len(row.label.effects) == 1 and not row.label.within_tolerance]


def pairs(rows: Rows) -> list[CaseResult]:
    return [row for row in rows if len(row.label.effects) == 2]


def nulls(rows: Rows) -> list[CaseResult]:
    """No effect at all: background, and nominal figures that are a little wrong."""
    return [row for row in rows if row.label.key == NONE]


def strangers(rows: Rows) -> list[CaseResult]:
    """An effect outside the catalogue, with a gap beyond tolerance."""
    return [row for row in rows if row.label.family and not row.label.within_tolerance]


def first_label(row: CaseResult) -> bool:
    """Whether the likeliest member of the first entry is right."""
    return row.said.labels[:1] != () and row.said.labels[0] in row.label.accepted


def first_entry(row: CaseResult) -> bool:
    """Whether the first entry, be it a group, holds what is right."""
    return bool(row.said.entries) and bool(row.label.accepted & set(row.said.entries[0].labels))


def first_two(row: CaseResult) -> bool:
    """Whether one of the first two labels as they are read is right."""
    return bool(row.label.accepted & set(row.said.labels[:2]))


def first_two_entries(row: CaseResult) -> bool:
    """Whether one of the first two entries holds what is right."""
    return any(row.label.accepted & set(entry.labels) for entry in row.said.entries[:2])


def in_set(row: CaseResult) -> bool:
    """Whether the smallest set of labels with 90 % of the probability holds what is right."""
    return bool(row.label.accepted & set(label_set(row.said.probabilities)))


def at_least_one(row: CaseResult) -> bool:
    """Of two effects, whether the first label names one."""
    return bool(set(row.label.effects) & set(_first(row.said).split("+")))


def accused(row: CaseResult) -> bool:
    """Whether the first answer is another than "none"; no answer is as bad."""
    return _first(row.said) != NONE


def called_unknown(row: CaseResult) -> bool:
    return _first(row.said) == UNKNOWN


def rate(rows: Rows, right: Callable[[CaseResult], bool]) -> Rate:
    return Rate.of(right(row) for row in rows)


def _first(answer: CaseAnswer) -> str:
    return answer.labels[0] if answer.labels else ""


def stage_hits(rows: Sequence[CaseResult]) -> Rate:
    """How often the first stage named is one where the gap is, among rows whose truth has one."""
    held = [row for row in rows if row.label.stages]
    return Rate.of(
        row.said.stages[:1] != () and row.said.stages[0] in row.label.stages for row in held
    )


def region_scores(rows: Sequence[CaseResult]) -> list[float]:
    """F1 of the first region named, over configurations, where the effect acts in some of them
    only; 0 if none is."""
    held = [row for row in rows if row.label.inside is not None]
    return [
        f1(row.said.inside[0] if row.said.inside else (), row.label.inside or ()) for row in held
    ]


def mean_region_score(rows: Sequence[CaseResult]) -> float:
    scores = region_scores(rows)
    return float(np.mean(scores)) if scores else math.nan


def f1(named: Collection[int], true: Collection[int]) -> float:
    """2 |A and B| / (|A| + |B|); 0 for two empty sets."""
    both, total = len(set(named) & set(true)), len(set(named)) + len(set(true))
    return 2 * both / total if total else 0.0
