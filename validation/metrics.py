"""The figures of a table: one function from rows to a record. Pure; nothing here has seen a
campaign.

How far the gap shrank, beside what the right effect would have done.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..diagnosis.verdict import UNKNOWN
from . import answer_sets
from .answer_sets import (
    Bin,
    Rate,
    brier,
    calibration_error,
    curve,
    label_set,
    mean_region_score,
    negative_log,
    region_scores,
    stage_hits,
)
from .case_results import CaseResult, fraction_of


def auroc(of_these: Sequence[float], of_others: Sequence[float]) -> float:
    """The chance that one of these has a larger score than one of the others; ties count half. NaN
    without both."""
    if not of_these or not of_others:
        return math.nan
    from scipy.stats import rankdata

    ranks = rankdata(np.concatenate([of_these, of_others]))
    n = len(of_these)
    return float((ranks[:n].sum() - n * (n + 1) / 2) / (n * len(of_others)))


def threshold_at(false_share: float, of_others: Sequence[float]) -> float:
    """The least score above which at most `false_share` of the others lie."""
    falling = np.sort(np.asarray(of_others, dtype=np.float64))[::-1]
    allowed = int(false_share * len(falling) + 1e-9)
    return float(falling[allowed]) if allowed < len(falling) else -math.inf


def found_above(of_these: Sequence[float], threshold: float) -> list[bool]:
    """Which of these have a larger score."""
    return [score > threshold for score in of_these]


#: An answer that never came.
NO_ANSWER = "no answer"


def confusion(rows: Sequence[CaseResult]) -> dict[str, dict[str, int]]:
    """By truth, how often each label was the first one; both in falling number, then by name."""
    counts: dict[str, Counter[str]] = {}
    for row in rows:
        first = row.said.labels[0] if row.said.labels else NO_ANSWER
        counts.setdefault(row.label.key, Counter())[first] += 1
    falling = sorted(counts, key=lambda truth: (-counts[truth].total(), truth))
    return {
        truth: dict(sorted(counts[truth].items(), key=lambda item: (-item[1], item[0])))
        for truth in falling
    }


def mistaken(rows: Sequence[CaseResult], most: int = 12) -> list[tuple[str, str, int]]:
    """The most frequent errors: truth, what was said for it, how often."""
    wrong = Counter(
        (row.label.key, row.said.labels[0] if row.said.labels else NO_ANSWER)
        for row in rows
        if not row.said.labels or row.said.labels[0] not in row.label.accepted
    )
    falling = sorted(wrong.items(), key=lambda item: (-item[1], item[0]))
    return [(truth, answer, n) for (truth, answer), n in falling[:most]]


#: An oracle that shrinks the gap by less has nothing to be compared with.
_LEAST = 0.05


@dataclass(frozen=True)
class GapReductionScore:
    """`ratio` of the share that was removed to the share that the right effect removes: its median
    and 10th percentile.

    `covered` counts intervals that hold the true share, where it is known.
    """

    ratio_median: float
    ratio_10: float
    fraction_median: float
    n: int
    covered: Rate

    def as_json(self) -> dict[str, Any]:
        return {**vars(self), "covered": self.covered.as_json()}


def gap_reduction_score(rows: Sequence[CaseResult]) -> GapReductionScore:
    """Over the rows whose oracle found a gap to shrink. A report without a share counts as 0:
    nothing was removed."""
    held = [row for row in rows if (fraction_of(row.oracle) or 0.0) > _LEAST]
    reported = np.array([fraction_of(row.said.shrinkage) or 0.0 for row in held])
    best = np.array([fraction_of(row.oracle) for row in held], dtype=np.float64)
    if not held:
        return GapReductionScore(math.nan, math.nan, math.nan, 0, covered(rows))
    ratio = reported / best
    return GapReductionScore(
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


Rows = Sequence[CaseResult]


@dataclass(frozen=True)
class Unknowns:
    """Effects outside the catalogue against all other cases, by the probability of "unknown".

    `recall_at_5` where 5 % of the others lie above; `declared` and `wrongly` where "unknown" was
    the first answer.
    """

    auroc: float
    recall_at_5: Rate
    declared: Rate
    wrongly: Rate


@dataclass(frozen=True)
class Reliability:
    """Of the first entry as it is printed, and of its likeliest label alone; over labels in `nll`
    and `brier`."""

    ece: float
    ece_label: float
    nll: float
    brier: float
    curve: tuple[Bin, ...]


@dataclass(frozen=True)
class CaseMetrics:
    """Everything that is told of some cases by one way of answering."""

    name: str
    n: int
    first: Rate
    first_group: Rate
    first_two: Rate
    first_two_groups: Rate
    false_alarms: Rate
    unknown: Unknowns
    reliability: Reliability
    covered: Rate
    set_size: float
    group_size: float
    both: Rate
    at_least_one: Rate
    stage: Rate
    region_f1: float
    regions: int
    shrinkage: GapReductionScore
    seconds: tuple[float, float]  # median and 95th percentile
    errors: tuple[str, ...]
    confusion: dict[str, dict[str, int]]
    mistaken: tuple[tuple[str, str, int], ...]

    def as_json(self) -> dict[str, Any]:
        return {key: _plain(value) for key, value in vars(self).items()}


def figures(name: str, rows: Rows) -> CaseMetrics:
    single, two = answer_sets.singles(rows), answer_sets.pairs(rows)
    return CaseMetrics(
        name=name,
        n=len(rows),
        first=answer_sets.rate(single, answer_sets.first_label),
        first_group=answer_sets.rate(single, answer_sets.first_entry),
        first_two=answer_sets.rate(single, answer_sets.first_two),
        first_two_groups=answer_sets.rate(single, answer_sets.first_two_entries),
        false_alarms=answer_sets.rate(answer_sets.nulls(rows), answer_sets.accused),
        unknown=unknowns(rows),
        reliability=reliability(rows),
        covered=answer_sets.rate(rows, answer_sets.in_set),
        set_size=_mean([len(label_set(row.said.probabilities)) for row in rows]),
        group_size=_mean([len(row.said.entries[0].labels) for row in rows if row.said.entries]),
        both=answer_sets.rate(two, answer_sets.first_entry),
        at_least_one=answer_sets.rate(two, answer_sets.at_least_one),
        stage=stage_hits([*single, *answer_sets.strangers(rows)]),
        region_f1=mean_region_score(single),
        regions=len(region_scores(single)),
        shrinkage=gap_reduction_score(single),
        seconds=_seconds(rows),
        errors=tuple(f"{row.said.case}: {row.said.error}" for row in rows if row.said.error),
        confusion=confusion(rows),
        mistaken=tuple(mistaken(rows)),
    )


def unknowns(rows: Rows) -> Unknowns:
    """Cases of unknown effects within tolerance stand on neither side."""
    these, others = answer_sets.strangers(rows), [row for row in rows if not row.label.family]
    scores = [
        [row.said.probabilities.get(UNKNOWN, 0.0) for row in side] for side in (these, others)
    ]
    least = threshold_at(0.05, scores[1])
    return Unknowns(
        auroc(*scores),
        Rate.of(found_above(scores[0], least)),
        answer_sets.rate(these, answer_sets.called_unknown),
        answer_sets.rate(others, answer_sets.called_unknown),
    )


def reliability(rows: Rows) -> Reliability:
    """Cases without an answer said no probability: the curve leaves them out, NLL and Brier do
    not."""
    answered = [row for row in rows if row.said.entries]
    entry = np.array([row.said.entries[0].probability for row in answered])
    label = np.array([row.said.probabilities[row.said.labels[0]] for row in answered])
    grouped = np.array([answer_sets.first_entry(row) for row in answered], dtype=bool)
    exact = np.array([answer_sets.first_label(row) for row in answered], dtype=bool)
    return Reliability(
        calibration_error(entry, grouped),
        calibration_error(label, exact),
        negative_log(rows),
        brier(rows),
        curve(entry, grouped),
    )


def _seconds(rows: Rows) -> tuple[float, float]:
    durations_s = [row.said.seconds for row in rows if np.isfinite(row.said.seconds)]
    if not durations_s:
        return math.nan, math.nan
    return float(np.median(durations_s)), float(np.percentile(durations_s, 95))


def _mean(values: Sequence[float]) -> float:
    return float(np.mean(values)) if len(values) else float("nan")


def _plain(value: Any) -> Any:
    """Records as objects, tuples as lists, and what there is none of (NaN) as null: JSON knows no
    NaN."""
    if hasattr(value, "as_json"):
        return _plain(value.as_json())
    if isinstance(value, Unknowns | Reliability | GapReductionScore):
        return _plain(vars(value))
    if isinstance(value, dict):
        return {key: _plain(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(entry) for entry in value]
    return None if isinstance(value, float) and not np.isfinite(value) else value
