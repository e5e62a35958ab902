"""From opened labels and kept answers to the tables.

The other way round: an effect of the catalogue is taken out of it, and put back.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypedDict

import numpy as np

from ..diagnosis.verdict import UNKNOWN
from ..doe.factor_rules import holds
from .answer_sets import Rate, first_entry, stage_hits
from .baselines import BASELINES, Forest
from .bench_figures import BenchFigures, bench_tables
from .case_plan import BENCHES, LEFT_OUT, CaseTask
from .case_results import CaseAnswer, CaseResult, WithheldTruth, stages_of
from .cases.attribution import shares
from .cases.case import Label as Opened
from .cause_figures import CauseFigures, cause_tables
from .metrics import NO_ANSWER, CaseMetrics, figures


@dataclass(frozen=True)
class ExcludedEffect:
    """Without the effect: `unknown` was the first answer, `others` when a remaining effect was, and
    `stage` was named. With it: `found` first, or in the first group; `fraction` of the gap that
    disappeared (median), of `n` with a gap.

    `instead`: by the effect left out, what was said for it and how often.
    """

    n: int
    unknown: Rate
    others: Rate
    stage: Rate
    found: Rate
    fraction: float
    instead: Mapping[str, Mapping[str, int]]

    def as_json(self) -> dict[str, Any]:
        rates = {
            name: getattr(self, name).as_json() for name in ("unknown", "others", "stage", "found")
        }
        fraction = self.fraction if np.isfinite(self.fraction) else None
        return {
            "n": self.n,
            **rates,
            "fraction": fraction,
            "instead": {k: dict(v) for k, v in self.instead.items()},
        }


def left_out(
    labels: Sequence[WithheldTruth], without: Sequence[CaseAnswer], added: Sequence[CaseAnswer]
) -> ExcludedEffect:
    """From what was said without and with the effect of each label."""
    first = [answer.labels[0] if answer.labels else "" for answer in without]
    shares = [(answer.shrinkage or {}).get("fraction") for answer in added]
    reported_shares = [share for share in shares if share is not None]
    instead: dict[str, Counter[str]] = {}
    for label, name in sorted(zip(labels, first, strict=True), key=lambda item: item[0].key):
        instead.setdefault(label.key, Counter())[name or NO_ANSWER] += 1
    return ExcludedEffect(
        n=len(labels),
        unknown=Rate.of(name == UNKNOWN for name in first),
        others=Rate.of("." in name for name in first),
        stage=stage_hits(
            [CaseResult(label, answer) for label, answer in zip(labels, without, strict=True)]
        ),
        found=Rate.of(
            first_entry(CaseResult(label, answer))
            for label, answer in zip(labels, added, strict=True)
        ),
        fraction=float(np.median(reported_shares)) if reported_shares else float("nan"),
        instead=instead,
    )


#: An effect acts where it does more than this part of the most that it does anywhere.
_ACTS = 0.02


def label(task: CaseTask, opened: Opened) -> WithheldTruth:
    """What was withheld, as it is scored."""
    effects = tuple(name for name in opened.cause if name not in ("none", "unknown"))
    present = tuple(opened.gap)
    shown = [stage for effect in effects for stage in stages_of(effect) if stage in present]
    return WithheldTruth(
        case=task.name,
        tier=task.tier,
        kind=opened.kind,
        effects=effects,
        family=opened.family or "",
        gap_in_floors=opened.ratio,
        gap_in_tolerances=max(opened.gap.values(), default=0.0),
        stages=tuple(dict.fromkeys(shown))
        if len(effects) == 1
        else tuple(filter(None, [opened.stage])),
        inside=_inside(opened) if opened.region else None,
        rough=bool(opened.background.get("rough")),
        shares=shares(opened.left_out),
        shapley=shares(opened.shapley),
        shown=opened.shown,
        traces=opened.traces,
    )


def named_regions(opened: Opened, factors: Sequence[Mapping[str, Any]]) -> list[list[int]]:
    """The configurations of each region that a report names, by its rule."""
    return [
        [i for i, row in enumerate(opened.configurations) if _holds(str(region["rule"]), row)]
        for region in factors
    ]


def _inside(opened: Opened) -> tuple[int, ...]:
    size = np.max(
        [np.abs(np.array(rows)).max(axis=1) / _span(rows) for rows in opened.changes.values()],
        axis=0,
    )
    return tuple(int(i) for i in np.flatnonzero(size > _ACTS))


def _span(rows: Sequence[Sequence[float]]) -> float:
    return float(np.abs(np.array(rows)).max()) or 1.0


def _holds(rule: str, factors: Mapping[str, Any]) -> bool:
    try:
        return holds(rule, factors)
    except LookupError:  # a factor that is the same all over, or made by the ingest
        return False


FOREST, ALL = "random forest", "all"


class Scores(TypedDict):
    tiers: tuple[CaseMetrics, ...]
    kinds: tuple[CaseMetrics, ...]
    baselines: dict[str, tuple[CaseMetrics, ...]]
    left_out: ExcludedEffect | None
    benches: tuple[BenchFigures, ...]
    causes: tuple[CauseFigures, ...]


def scored(
    work: Sequence[CaseTask],
    truths: Mapping[str, Opened],
    answers: Mapping[str, Mapping[str, Any]],
    oracles: Mapping[str, Mapping[str, Any]],
    forest: Forest | None,
) -> Scores:
    """Tables of the diagnosis by tier and over all of them, the same for simple ways of answering,
    and left out."""
    usual = [task for task in work if task.tier != LEFT_OUT]
    labels = {task.name: label(task, truths[task.name]) for task in work}
    rows = rows_of(work, truths, answers, oracles)
    baseline_names = [*BASELINES, FOREST] if forest else list(BASELINES)
    if not any("simple" in answer for answer in answers.values()):
        baseline_names = []
    return Scores(
        tiers=tables(rows),
        kinds=kinds(rows),
        baselines={
            baseline: tables(
                [_simple(baseline, labels[t.name], answers[t.name], forest) for t in usual]
            )
            for baseline in baseline_names
        },
        benches=bench_tables(rows, tuple(BENCHES)),
        causes=cause_tables(rows, tuple(BENCHES)),
        left_out=_left_out(
            [task for task in work if task.tier == LEFT_OUT], labels, answers, truths
        ),
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
            scored_answer(task.name, answers[task.name], truths[task.name]),
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
    return tuple(
        figures(name, [row for row, own in zip(rows, names, strict=True) if own == name])
        for name in dict.fromkeys(names)
    )


def scored_answer(case: str, answer: Mapping[str, Any], opened: Opened) -> CaseAnswer:
    """An answer of the journal as it is scored."""
    seconds = answer.get("seconds")
    if "verdict" not in answer:
        return CaseAnswer(case, error=str(answer.get("error", "no answer")))
    verdict = {
        **answer["verdict"],
        "seconds": np.nan if seconds is None else seconds,
        "naive": answer.get("naive", {}).get("fraction"),
        "memory_mb": answer.get("memory_mb"),
        "cpu_s": answer.get("cpu_s"),
    }
    return CaseAnswer.of(case, verdict, named_regions(opened, verdict["where"].get("factors", ())))


def _simple(
    baseline: str, truth: WithheldTruth, answer: Mapping[str, Any], forest: Forest | None
) -> CaseResult:
    if "simple" not in answer:
        return CaseResult(
            truth, CaseAnswer(truth.case, error=str(answer.get("error", "no answer")))
        )
    if baseline == FOREST and forest is not None:
        shares = forest.shares(truth.kind, np.array(answer["features"]))
        return CaseResult(truth, CaseAnswer.from_probabilities(truth.case, shares))
    return CaseResult(truth, CaseAnswer.from_probabilities(truth.case, answer["simple"][baseline]))


def _left_out(
    work: Sequence[CaseTask],
    labels: Mapping[str, WithheldTruth],
    answers: Mapping[str, Mapping[str, Any]],
    truths: Mapping[str, Opened],
) -> ExcludedEffect | None:
    if not work:
        return None
    names = [task.name for task in work]
    without = [scored_answer(name, answers[name], truths[name]) for name in names]
    added = [scored_answer(name, answers[name].get("added", {}), truths[name]) for name in names]
    return left_out([labels[name] for name in names], without, added)
