"""Whether an answer names where the gap lies."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence

import numpy as np

from .case_results import CaseResult
from .wilson import Rate


def stage_hits(rows: Sequence[CaseResult]) -> Rate:
    """How often the first stage named is one where the gap is, among rows whose truth has one."""
    held = [row for row in rows if row.label.stages]
    return Rate.of(row.said.stages[:1] != () and row.said.stages[0] in row.label.stages for row in held)


def region_scores(rows: Sequence[CaseResult]) -> list[float]:
    """F1 of the first region named, over configurations, where the effect acts in some of them only; 0 if none is."""
    held = [row for row in rows if row.label.inside is not None]
    return [f1(row.said.inside[0] if row.said.inside else (), row.label.inside or ()) for row in held]


def mean_region_score(rows: Sequence[CaseResult]) -> float:
    scores = region_scores(rows)
    return float(np.mean(scores)) if scores else math.nan


def false_regions(rows: Sequence[CaseResult]) -> Rate:
    """How often a region is named although there is no effect."""
    return Rate.of(bool(row.said.inside) for row in rows)


def f1(named: Collection[int], true: Collection[int]) -> float:
    """2 |A and B| / (|A| + |B|); 0 for two empty sets."""
    both, total = len(set(named) & set(true)), len(set(named)) + len(set(true))
    return 2 * both / total if total else 0.0
