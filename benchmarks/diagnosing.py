"""`python -m benchmarks.diagnosing`: the diagnosis beside simpler ways of answering, on fresh virtual campaigns.

Each campaign hides one effect of the catalogue with a gap of 3 to 6 floors; the kinds take turns. Every way gets the
same folder. What is measured is the time from the folder to an answer, whether the right effect comes first, and the
Brier score of the probabilities (0 to 2, less is better). A handful of campaigns tells times well and rates badly: the
rates of the kept checks stand beside ours. The limit of what weighs effects is to read the folder and simulate each.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import cycle, islice
from pathlib import Path
from typing import Any

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

from .figures import Figure, missing
from .measuring import ROOT, Spread, ratio

THEME = "Diagnosis of {} fresh virtual campaigns with one strong effect, beside simpler ways"
CAMPAIGNS, SEED, LEARN_FROM = 6, 811_001, 8
TIER = "strong"
#: Where and causes, as the blind check asks for them; the shrinkage and the next experiment no simpler way has.
ASKED = Options(shrink=False, plan=OPTIONS.plan, rate_pulses=OPTIONS.rate_pulses)
OURS, READING = "diagnosis", "reading and simulating"
KEPT = ROOT / "docs" / "blind-check"


@dataclass
class Answers:
    """Of one campaign: what each way said, the seconds that it took from the folder on, and those of the limit."""

    truth: WithheldTruth
    said: dict[str, CaseAnswer] = field(default_factory=dict)
    seconds: dict[str, float] = field(default_factory=dict)


def measure_diagnosing(
    _folder: Path, full: bool = False, campaigns: int = CAMPAIGNS, learn_from: int = LEARN_FROM
) -> Iterator[Figure]:
    """`learn_from` 0: without a random forest, which learns from so many other campaigns first. `full`: 24 and 40."""
    campaigns, learn_from = (24, 40) if full else (campaigns, learn_from)
    forest = trained(learn_from, SEED, ExecutorConfig(jobs=2), lambda *_: None) if learn_from else None
    found = [_answered(*drawn(kind, i), forest) for i, kind in enumerate(islice(cycle(KINDS), campaigns))]
    ways = [*BASELINES, *([FOREST] if forest else [])]
    for way in ways:
        yield _time(found, way, learn_from)
    for way in ways:
        yield _quality(found, way)
    if not forest:
        yield missing(THEME.format(campaigns), f"the right effect, beside {FOREST}", "not asked for", rival=FOREST)


def drawn(kind: str, number: int) -> tuple[Case, int, CaseTask]:
    """A case, the seed of its recording, and the task that names it."""
    task = CaseTask(f"{kind}-{number}", TIER, (SEED, number))
    rng = np.random.default_rng(task.seed)
    case = draw_case(kind, TIER, rng, cause="catalogue")
    return case, int(rng.integers(2**31)), task


def _answered(case: Case, seed: int, task: CaseTask, forest: Forest | None) -> Answers:
    from threadpoolctl import threadpool_limits

    found = Answers(label(task, label_of(case, seed)))
    with threadpool_limits(1), tempfile.TemporaryDirectory() as place:
        folder = Path(place) / "campaign"
        record_case(case, folder, seed)
        begin = time.perf_counter()
        verdict = diagnose(read_folder(folder), options=ASKED)
        found.seconds[OURS] = time.perf_counter() - begin
        found.said[OURS] = CaseAnswer.of(task.name, verdict.as_json())
        _simply(folder, found, forest)
    return found


def _simply(folder: Path, found: Answers, forest: Forest | None) -> None:
    """The simpler ways, which share the reading, and those that weigh effects their simulation."""
    begin = time.perf_counter()
    stages, _ = stages_of(record := read_folder(folder), ASKED)
    gap = GapTable.of(record, stages, ASKED.tolerance_scale)
    read = time.perf_counter() - begin
    problem = GapProblem.of(gap, InferenceProblem.of(gap, stages, list(catalogue().values())))
    found.seconds[READING] = time.perf_counter() - begin
    for name, answer in BASELINES.items():
        begin = time.perf_counter()
        said = answer(problem)
        found.seconds[name] = found.seconds[READING] + time.perf_counter() - begin
        found.said[name] = CaseAnswer.from_probabilities(found.truth.case, said)
    if forest:
        begin = time.perf_counter()
        said = forest.shares(found.truth.kind, features(GapProblem.of(gap)))
        found.seconds[FOREST] = read + time.perf_counter() - begin
        found.said[FOREST] = CaseAnswer.from_probabilities(found.truth.case, said)


def _time(found: Sequence[Answers], way: str, learn_from: int) -> Figure:
    ours, peer, least = ([one.seconds[name] for one in found] for name in (OURS, way, READING))
    nature = "reading the folder and simulating every effect"
    if way == FOREST:
        nature += f"; the forest learned from {learn_from} campaigns before"
    own, other = (Spread.of(values).text(" s") for values in (ours, peer))
    return Figure(
        THEME.format(len(found)), f"from the folder to an answer, beside {way}", own, other, ratio(ours, peer),
        nature=nature, near=ratio(ours, least), question="the time of a diagnosis", rival=way,
    )  # fmt: skip


def _quality(found: Sequence[Answers], way: str) -> Figure:
    told = {name: figures(name, _rows(found, name)) for name in (OURS, way)}
    mine, theirs = (
        f"{first_of(_rows(found, name))} of {len(found)} first, Brier {told[name].reliability.brier:.2f}"
        for name in (OURS, way)
    )
    own, other = (told[name].reliability.brier for name in (OURS, way))
    value = Spread.of([own / other if other else np.inf])
    return Figure(
        THEME.format(len(found)), f"the right effect, beside {way}", mine, theirs, value,
        of="quality", nature=kept_rates(), question="the right cause of a gap", rival=way,
    )  # fmt: skip


def first_of(rows: Sequence[CaseResult]) -> int:
    """How many have the right effect as their first label."""
    return sum(answer_sets.first_label(row) for row in rows)


def _rows(found: Sequence[Answers], way: str) -> list[CaseResult]:
    return [CaseResult(one.truth, one.said[way]) for one in found]


def kept_rates(folder: Path = KEPT) -> str:
    """What the kept rows say of ours with single effects of the same tier; they have no rows of simpler ways."""
    files = sorted(folder.glob("*.jsonl"))
    rows = [row for row in pooled(files)[1] if row.label.tier == TIER] if files else []
    if not rows:
        return "the kept checks are not here"
    told: Any = figures(TIER, rows)
    right = f"right first {told.first.value:.2f}, in the first group {told.first_group.value:.2f}"
    return f"kept checks, {told.first.n} such campaigns: {right}"


def main() -> None:
    for figure in measure_diagnosing(Path()):
        sys.stdout.write(figure.row() + "\n")


if __name__ == "__main__":
    main()
