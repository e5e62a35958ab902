"""The figures of a table: one function from rows to a record. Pure; nothing here has seen a campaign."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..diagnosis.verdict import UNKNOWN
from . import answer_sets
from .auroc import auroc, found_above, threshold_at
from .case_places import mean_region_score, region_scores, stage_hits
from .case_results import CaseResult
from .confusion import confusion, mistaken
from .gap_reduction_score import Shrunk, shrunk
from .reliability import Bin, brier, calibration_error, curve, label_set, negative_log
from .wilson import Rate

Rows = Sequence[CaseResult]


@dataclass(frozen=True)
class Unknowns:
    """Effects outside the catalogue against all other cases, by the probability of "unknown".

    `recall_at_5` where 5 % of the others lie above; `declared` and `wrongly` where "unknown" was the first answer.
    """

    auroc: float
    recall_at_5: Rate
    declared: Rate
    wrongly: Rate


@dataclass(frozen=True)
class Reliability:
    """Of the first entry as it is printed, and of its likeliest label alone; over labels in `nll` and `brier`."""

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
    shrinkage: Shrunk
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
        shrinkage=shrunk(single),
        seconds=_seconds(rows),
        errors=tuple(f"{row.said.case}: {row.said.error}" for row in rows if row.said.error),
        confusion=confusion(rows),
        mistaken=tuple(mistaken(rows)),
    )


def unknowns(rows: Rows) -> Unknowns:
    """Cases of unknown effects within tolerance stand on neither side."""
    these, others = answer_sets.strangers(rows), [row for row in rows if not row.label.family]
    scores = [[row.said.probabilities.get(UNKNOWN, 0.0) for row in side] for side in (these, others)]
    least = threshold_at(0.05, scores[1])
    return Unknowns(
        auroc(*scores),
        Rate.of(found_above(scores[0], least)),
        answer_sets.rate(these, answer_sets.called_unknown),
        answer_sets.rate(others, answer_sets.called_unknown),
    )


def reliability(rows: Rows) -> Reliability:
    """Cases without an answer said no probability: the curve leaves them out, NLL and Brier do not."""
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
    return (
        (float(np.median(durations_s)), float(np.percentile(durations_s, 95)))
        if durations_s
        else (float("nan"), float("nan"))
    )


def _mean(values: Sequence[float]) -> float:
    return float(np.mean(values)) if len(values) else float("nan")


def _plain(value: Any) -> Any:
    """Records as objects, tuples as lists, and what there is none of (NaN) as null: JSON knows no NaN."""
    if hasattr(value, "as_json"):
        return _plain(value.as_json())
    if isinstance(value, Unknowns | Reliability | Shrunk):
        return _plain(vars(value))
    if isinstance(value, dict):
        return {key: _plain(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(entry) for entry in value]
    return None if isinstance(value, float) and not np.isfinite(value) else value
