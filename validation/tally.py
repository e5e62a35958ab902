"""From opened labels and kept answers to the tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, TypedDict

import numpy as np

from .baselines import BASELINES
from .bench_figures import BenchFigures, bench_tables
from .case_plan import BENCHES, LEFT_OUT, CaseTask
from .case_results import CaseResult, Said, WithheldTruth
from .cases.case import Label as Opened
from .excluded_cases import LeftOut, left_out
from .metrics import CaseMetrics, figures
from .random_forest_baseline import Forest
from .truth import label, named_regions

FOREST, ALL = "random forest", "all"


class Scores(TypedDict):
    tiers: tuple[CaseMetrics, ...]
    kinds: tuple[CaseMetrics, ...]
    baselines: dict[str, tuple[CaseMetrics, ...]]
    left_out: LeftOut | None
    benches: tuple[BenchFigures, ...]


def scored(
    work: Sequence[CaseTask],
    truths: Mapping[str, Opened],
    answers: Mapping[str, Mapping[str, Any]],
    oracles: Mapping[str, Mapping[str, Any]],
    forest: Forest | None,
) -> Scores:
    """Tables of the diagnosis by tier and over all of them, the same for simple ways of answering, and left out."""
    usual = [task for task in work if task.tier != LEFT_OUT]
    labels = {task.name: label(task, truths[task.name]) for task in work}
    rows = rows_of(work, truths, answers, oracles)
    baseline_names = (
        [*BASELINES, *([FOREST] if forest else [])] if any("simple" in answer for answer in answers.values()) else []
    )
    return Scores(
        tiers=tables(rows),
        kinds=kinds(rows),
        baselines={
            baseline: tables([_simple(baseline, labels[t.name], answers[t.name], forest) for t in usual])
            for baseline in baseline_names
        },
        benches=bench_tables(rows, tuple(BENCHES)),
        left_out=_left_out([task for task in work if task.tier == LEFT_OUT], labels, answers, truths),
    )


def rows_of(
    work: Sequence[CaseTask],
    truths: Mapping[str, Opened],
    answers: Mapping[str, Mapping[str, Any]],
    oracles: Mapping[str, Mapping[str, Any]],
) -> list[CaseResult]:
    """Truth and answer of every case but those with an effect left out of the catalogue."""
    return [
        CaseResult(
            label(task, truths[task.name]),
            said(task.name, answers[task.name], truths[task.name]),
            oracles.get(task.name),
        )
        for task in work
        if task.tier != LEFT_OUT
    ]


def kinds(rows: Sequence[CaseResult]) -> tuple[CaseMetrics, ...]:
    """One for each kind of campaign."""
    return _by([row.label.kind for row in rows], rows)


def tables(rows: Sequence[CaseResult]) -> tuple[CaseMetrics, ...]:
    """One for each tier in order of appearance, and one for all."""
    return (*_by([row.label.tier for row in rows], rows), figures(ALL, rows)) if rows else ()


def _by(names: Sequence[str], rows: Sequence[CaseResult]) -> tuple[CaseMetrics, ...]:
    rows_by_name = {
        name: [row for row, own in zip(rows, names, strict=True) if own == name] for name in dict.fromkeys(names)
    }
    return tuple(figures(name, some) for name, some in rows_by_name.items())


def said(case: str, answer: Mapping[str, Any], opened: Opened) -> Said:
    """An answer of the journal as it is scored."""
    seconds = answer.get("seconds")
    if "verdict" not in answer:
        return Said(case, error=str(answer.get("error", "no answer")))
    verdict = {
        **answer["verdict"],
        "seconds": np.nan if seconds is None else seconds,
        "naive": answer.get("naive", {}).get("fraction"),
        "memory_mb": answer.get("memory_mb"),
    }
    return Said.of(case, verdict, named_regions(opened, verdict["where"].get("factors", ())))


def _simple(way: str, truth: WithheldTruth, answer: Mapping[str, Any], forest: Forest | None) -> CaseResult:
    if "simple" not in answer:
        return CaseResult(truth, Said(truth.case, error=str(answer.get("error", "no answer"))))
    if way == FOREST and forest is not None:
        shares = forest.shares(truth.kind, np.array(answer["features"]))
        return CaseResult(truth, Said.from_probabilities(truth.case, shares))
    return CaseResult(truth, Said.from_probabilities(truth.case, answer["simple"][way]))


def _left_out(
    work: Sequence[CaseTask],
    labels: Mapping[str, WithheldTruth],
    answers: Mapping[str, Mapping[str, Any]],
    truths: Mapping[str, Opened],
) -> LeftOut | None:
    if not work:
        return None
    names = [task.name for task in work]
    without = [said(name, answers[name], truths[name]) for name in names]
    added = [said(name, answers[name].get("added", {}), truths[name]) for name in names]
    return left_out([labels[name] for name in names], without, added)
