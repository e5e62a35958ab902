"""`python -m benchmarks.diagnosing`: the diagnosis beside simpler methods, on fresh virtual
campaigns.

Each campaign hides one effect of the catalogue with a gap of 3 to 6 floors; the kinds take turns.
Every method gets the same folder. The figures are the time from the folder to an answer, whether
the right effect comes first, and the Brier score of the probabilities (0 to 2, less is better). A
handful of campaigns gives good times and poor rates: the rates of the recorded checks stand beside
ours. The limit of what weighs effects is to read the folder and simulate each.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import cycle, islice
from pathlib import Path

import numpy as np
from pyroshock.diagnosis.chain import stages_of
from pyroshock.diagnosis.diagnose import diagnose
from pyroshock.diagnosis.gap import GapTable
from pyroshock.diagnosis.inference.problem import InferenceProblem
from pyroshock.diagnosis.options import Options
from pyroshock.diagnosis.reading import read_folder
from pyroshock.parallel.executor import ExecutorConfig
from pyroshock.twin.effects import catalogue
from pyroshock.validation import answer_sets
from pyroshock.validation.baselines import BASELINES, Forest, GapProblem, features
from pyroshock.validation.blind_check import OPTIONS, trained
from pyroshock.validation.case_plan import CaseTask
from pyroshock.validation.case_results import CaseAnswer, CaseResult, WithheldTruth
from pyroshock.validation.cases.case import KINDS, Case
from pyroshock.validation.cases.draw import draw_case
from pyroshock.validation.cases.record import label_of, record_case
from pyroshock.validation.metrics import figures
from pyroshock.validation.report import pooled
from pyroshock.validation.tally import FOREST, label
from threadpoolctl import threadpool_limits

from .harness import ROOT, Figure, Spread, beside, report

THEME = "Diagnosis of {} fresh virtual campaigns with one strong effect, beside simpler methods"
CAMPAIGNS, SEED, LEARN_FROM, TIER = 6, 811_001, 8, "strong"
#: Where and causes, as the blind check asks for them; the shrinkage and the next experiment no
#: simpler method has.
ASKED = Options(shrink=False, plan=OPTIONS.plan, rate_pulses=OPTIONS.rate_pulses)
OURS, READING = "ours", "bound"
RECORDED_CHECKS = ROOT / "docs" / "blind-check"


@dataclass
class Answers:
    """Of one campaign, by method: its answer, and its seconds from the folder on; those of the
    limit, too."""

    truth: WithheldTruth
    answers: dict[str, CaseAnswer] = field(default_factory=dict)
    seconds: dict[str, float] = field(default_factory=dict)


def measure_diagnosing(
    _folder: Path, campaigns: int = CAMPAIGNS, learn_from: int = LEARN_FROM
) -> Iterator[Figure]:
    """`learn_from`: so many other campaigns the random forest learns from first; 0: without it."""
    forest = (
        trained(learn_from, SEED, ExecutorConfig(jobs=2), lambda *_: None) if learn_from else None
    )
    cases = [
        _answered(*drawn(kind, i), forest) for i, kind in enumerate(islice(cycle(KINDS), campaigns))
    ]
    methods = [*BASELINES, *([FOREST] if forest else [])]
    seconds = {name: [case.seconds[name] for case in cases] for name in (OURS, READING, *methods)}
    for method in methods:
        learned = (
            f"the forest learned from {learn_from} campaigns before; " if method == FOREST else ""
        )
        yield beside(
            THEME.format(campaigns), f"from the folder to an answer, beside {method}", seconds,
            method, unit="s",
            bound=f"{learned}reading the folder and simulating every effect",
            question="the time of a diagnosis",
        )  # fmt: skip
    for method in methods:
        rows = [
            [CaseResult(case.truth, case.answers[name]) for case in cases]
            for name in (OURS, method)
        ]
        brier, peer_brier = (figures(method, method_rows).reliability.brier for method_rows in rows)
        own, other = (
            f"{sum(map(answer_sets.first_label, method_rows))} of {campaigns} "
            f"first, Brier {score:.2f}"
            for method_rows, score in zip(rows, (brier, peer_brier), strict=True)
        )
        yield Figure(
            THEME.format(campaigns), f"the right effect, beside {method}", own, other,
            Spread.of([brier / peer_brier if peer_brier else np.inf]), kind="quality",
            bound=recorded_rates(),
            question="the right cause of a gap", peer_name=method,
        )  # fmt: skip


def drawn(kind: str, number: int) -> tuple[Case, int, CaseTask]:
    """A case, the seed of its recording, and the task that names it."""
    task = CaseTask(f"{kind}-{number}", TIER, (SEED, number))
    rng = np.random.default_rng(task.seed)
    case = draw_case(kind, TIER, rng, cause="catalogue")
    return case, int(rng.integers(2**31)), task


def _answered(case: Case, seed: int, task: CaseTask, forest: Forest | None) -> Answers:
    """The simpler methods share the reading, and those that weigh effects their simulation."""
    result = Answers(label(task, label_of(case, seed)))
    with threadpool_limits(1), tempfile.TemporaryDirectory() as place:
        folder = Path(place) / "campaign"
        record_case(case, folder, seed)
        begin = time.perf_counter()
        verdict = diagnose(read_folder(folder), options=ASKED)
        result.seconds[OURS] = time.perf_counter() - begin
        result.answers[OURS] = CaseAnswer.of(task.name, verdict.as_json())
        begin = time.perf_counter()
        stages, _ = stages_of(record := read_folder(folder), ASKED)
        gap = GapTable.of(record, stages, ASKED.tolerance_scale)
        read = time.perf_counter() - begin
        problem = GapProblem.of(gap, InferenceProblem.of(gap, stages, list(catalogue().values())))
        result.seconds[READING] = time.perf_counter() - begin
        for name, baseline in BASELINES.items():
            begin = time.perf_counter()
            probabilities = baseline(problem)
            result.seconds[name] = result.seconds[READING] + time.perf_counter() - begin
            result.answers[name] = CaseAnswer.from_probabilities(result.truth.case, probabilities)
        if forest:
            begin = time.perf_counter()
            probabilities = forest.shares(result.truth.kind, features(GapProblem.of(gap)))
            result.seconds[FOREST] = read + time.perf_counter() - begin
            result.answers[FOREST] = CaseAnswer.from_probabilities(result.truth.case, probabilities)
    return result


def recorded_rates(folder: Path = RECORDED_CHECKS) -> str:
    """Our rates with single effects of the same tier in the recorded checks, which have no simpler
    methods."""
    files = sorted(folder.glob("*.jsonl"))
    rows = [row for row in pooled(files)[1] if row.label.tier == TIER] if files else []
    if not rows:
        return "the recorded checks are not here"
    rates = figures(TIER, rows)
    right = f"right first {rates.first.value:.2f}, in the first group {rates.first_group.value:.2f}"
    return f"recorded checks, {rates.first.n} such campaigns: {right}"


if __name__ == "__main__":
    sys.exit(report(measure_diagnosing))
