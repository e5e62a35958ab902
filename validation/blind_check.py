"""The blind check from end to end: draw, publish hashes, record and answer, and only then open the
labels.

Answers as they come, a line of JSON each: a check that is stopped goes on where it was.

Campaigns that the random forest learns from: other seeds, and other effects outside the catalogue.
"""

from __future__ import annotations

import json
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..diagnosis.options import Options
from ..files.atomic_write import write_bytes, write_text
from ..parallel.executor import ExecutorConfig
from ..parallel.map_tasks import run_all_tasks
from ..parallel.phases import Phases
from ..parallel.task import one_thread
from . import oracle_fit
from .baselines import Forest
from .case_plan import BENCHES, TIERS, CaseTask, case_of_task, tasks
from .cases.case import Label as Opened
from .cases.record import label_of, new_key, open_labels, publish, record_case, seal_labels
from .report import SCORED, Report, write_rows
from .run_case import (
    PATIENCE_S,
    CaseJob,
    answer_case,
    answer_of_lost_worker,
    featured,
    gap_of_folder,
)
from .tally import rows_of, scored

#: Kept apart from the seeds of cases.
_SEED, _SPLIT = 20_000_003, "development"
_PATIENCE_S = 300.0
#: Seconds of a case in each phase, as measured over three tiers; an effect that is fitted for
#: comparison is one of a third of the cases.
_LABEL_S, _ANSWER_S, _LEARNED_S, _ORACLE_S = 0.2, 30.0, 1.0, 0.8
_TIERS = ("weak", "middle", "strong", "very strong", "two")


def trained(
    count: int, seed: int, executor: ExecutorConfig, tell: Callable[[int, int, str], None]
) -> Forest | None:
    """A random forest that has learned from campaigns of its own. None without scikit-learn, and
    where no campaign could be read.

    Parameters:
        count: The number of campaigns that it learns from.
        seed: Seed of these campaigns and of the forest. The campaigns are others than those of a
            check with the same seed.
        executor: Where the campaigns are simulated, and by how many processes.
        tell: Called with the campaigns done, their number and what is being done.
    """
    try:
        import sklearn  # noqa: F401
    except ModuleNotFoundError:
        return None
    tasks = [
        CaseTask(f"learn-{i:05d}", _TIERS[i % len(_TIERS)], (_SEED + seed, i), _SPLIT)
        for i in range(count)
    ]
    learnt: dict[str, dict[str, Any]] = {}
    for task, row in run_all_tasks(
        executor, _learnt, tasks, lost=_empty_answer, patience_s=_PATIENCE_S
    ):
        learnt[task.name] = row
        tell(len(learnt), count, "campaigns to learn from")
    rows = [
        learnt[task.name] for task in tasks if learnt[task.name]
    ]  # in their order: so are the forest's draws
    return of_rows(rows, seed) if rows else None


def of_rows(rows: Sequence[dict[str, Any]], seed: int) -> Forest:
    """A forest trained on rows of features and truth.

    Parameters:
        rows: One for each campaign: its "kind", its "features" as numbers, and "truth", the name of
            its cause.
        seed: Seed of the forest.
    """
    x = [np.array(row["features"]) for row in rows]
    return Forest.trained([row["kind"] for row in rows], x, [row["truth"] for row in rows], seed)


def _learnt(task: CaseTask) -> dict[str, Any]:
    """Features and truth of one campaign; {} where it could not be read."""
    from .baselines import GapProblem

    case, seed = case_of_task(task)
    with one_thread(), tempfile.TemporaryDirectory(prefix="pyroshock-blind-") as place:
        record_case(case, Path(place) / "campaign", seed)
        try:
            _, gap = gap_of_folder(Path(place) / "campaign", Options())
        except ValueError:
            return {}
    return {
        "kind": case.kind,
        "truth": "+".join(case.cause),
        "features": featured(GapProblem.of(gap)),
    }


def _empty_answer(_: CaseTask) -> dict[str, Any]:
    return {}


@dataclass(frozen=True)
class CaseJournal:
    """`path` holds one line for each case that was answered. None: nothing is kept."""

    path: Path | None

    def read(self) -> dict[str, dict[str, Any]]:
        """Answers by case. A last line that was cut off by a kill is no answer; it is cut away."""
        if self.path is None or not self.path.exists():
            return {}
        whole = self.path.read_bytes()
        ended = whole[: whole.rfind(b"\n") + 1]
        if ended != whole:
            self.path.write_bytes(ended)
        return {row["case"]: row for row in map(json.loads, ended.splitlines())}

    def add(self, answer: Mapping[str, Any]) -> None:
        """Append an answer to the file; do nothing where nothing is kept.

        Parameters:
            answer: A JSON object with the name of its case under "case" and no number that is not
                finite.
        """
        if self.path is None:
            return
        with self.path.open("ab") as file:
            file.write(json.dumps(answer, allow_nan=False).encode() + b"\n")


#: Called with (done, total, what).
Progress = Callable[[int, int, str], None]
#: Who answers, unless others are asked.
EXECUTOR = ExecutorConfig(jobs=2)
#: What of a diagnosis is scored: not the next experiment, and no ratings of pulses.
OPTIONS = Options(plan=False, rate_pulses=False)
_SETTINGS, _KEY, _SEALED, _PUBLISHED = "check.json", "key", "labels.sealed", "published.txt"
_ANSWERS, _ORACLES = "answers.jsonl", "oracles.jsonl"


def run(
    cases: int,
    seed: int,
    tiers: Sequence[str] = tuple(TIERS),
    *,
    executor: ExecutorConfig = EXECUTOR,
    folder: Path | None = None,
    progress: Progress | None = None,
    options: Options | None = None,
    baselines: bool = True,
    learn_from: int | None = None,
    oracle: bool = True,
    split: str = "sealed",
    kinds: Sequence[str] = (),
    patience_s: float = PATIENCE_S,
) -> Report:
    """Campaigns of each tier, drawn, answered and scored.

    Parameters:
        cases: The number of campaigns of each tier.
        seed: Seed of all draws: the same seed, the same campaigns.
        tiers: Names of `TIERS` in `validation.case_plan`; by default all of them.
        executor: Where the campaigns are answered, and by how many processes; by default by two on
            this machine.
        folder: Where hashes, sealed labels, key and answers are kept, so that a check that was
            stopped goes on. By default nothing is kept.
        progress: Called with the steps done, their number and what is being done; by default
            nothing is called.
        options: Options of the diagnosis; by default without the next experiment and without
            ratings of pulses.
        baselines: Whether the simple ways of answering are scored beside the diagnosis, which they
            are by default.
        learn_from: The number of campaigns that the forest among the baselines learns from: by
            default as many as are scored; 0: no forest.
        oracle: Whether the effect that really acts is fitted too, with which the reduction of the
            gap is compared. By default it is.
        split: The split of families, laws and seeds, one of `SPLITS`; by default "sealed".
        kinds: The kinds of campaigns that are drawn in the tiers in which kinds take turns; by
            default all.
        patience_s: The time after which a case is given up and has no answer; by default 900 s.

    Raises:
        ValueError: For a tier or kind that there is not, and for a folder of another check.
        SealError: For a folder of other labels than were published.
    """
    tell, options = progress or (lambda *_: None), options or OPTIONS
    work = tasks(cases, seed, tiers, split, kinds)
    with _work_folder(folder) as place:
        request: dict[str, Any] = {
            "cases": cases,
            "seed": seed,
            "tiers": list(dict.fromkeys(tiers)),
            "split": split,
        }
        request |= {"kinds": list(kinds)} if kinds else {}
        _same_check(place, request | {"shrinkage": options.shrink})
        learn = (len(work) if learn_from is None else learn_from) if baselines else 0
        phases = _phases(tell, len(work), learn, oracle)
        published = _published(place, work, executor, phases.of("labels"))
        answers = _answers(
            place,
            [CaseJob(task, options, baselines) for task in work],
            executor,
            phases.of("answers"),
            patience_s,
        )
        forest = trained(learn, seed, executor, phases.of("forest")) if learn else None
        opened = open_labels(place / _SEALED, (place / _KEY).read_bytes(), published)
        truths = dict(zip((task.name for task in work), opened, strict=True))
        tell_oracles = phases.of("oracles")
        best = (
            _oracles(place, work, truths, answers, options, executor, tell_oracles)
            if oracle
            else {}
        )
        write_rows(place / SCORED, request, rows_of(work, truths, answers, best))
    return Report(cases, seed, published=published, **scored(work, truths, answers, best, forest))


def _phases(tell: Progress, cases: int, learn: int, oracle: bool) -> Phases:
    """The phases of a check, by what they cost."""
    return Phases(
        tell,
        {
            "labels": _LABEL_S * cases,
            "answers": _ANSWER_S * cases,
            "forest": _LEARNED_S * learn,
            "oracles": _ORACLE_S * cases * oracle,
        },
    )


def _published(
    place: Path, work: Sequence[CaseTask], executor: ExecutorConfig, tell: Progress
) -> tuple[str, ...]:
    """Hashes of all labels, before anything is diagnosed; those of an earlier start where there are
    some."""
    if not (place / _PUBLISHED).exists():
        labels = _labels(work, executor, tell)
        key = new_key()
        (place / _SEALED).unlink(missing_ok=True)  # of a start that was stopped before it published
        write_bytes(place / _KEY, key)
        seal_labels(labels, place / _SEALED, key)
        write_text(place / _PUBLISHED, "\n".join(publish(labels, key)) + "\n")
    return tuple((place / _PUBLISHED).read_text(encoding="utf-8").split())


def _same_check(place: Path, settings: dict[str, Any]) -> None:
    file = place / _SETTINGS
    if file.exists() and json.loads(file.read_text(encoding="utf-8")) != settings:
        raise ValueError(
            f"{place}: holds a check with other settings; expected a new "
            f"folder, or {file.read_text()}"
        )
    write_text(file, json.dumps(settings))


def _answers(
    place: Path,
    work: Sequence[CaseJob],
    executor: ExecutorConfig,
    tell: Progress,
    patience_s: float,
) -> dict[str, dict[str, Any]]:
    journal = CaseJournal(place / _ANSWERS)
    answers = journal.read()
    remaining_jobs = [job for job in work if job.task.name not in answers]
    tell(len(work) - len(remaining_jobs), len(work), "answers")
    for job, answer in run_all_tasks(
        executor, answer_case, remaining_jobs, lost=answer_of_lost_worker, patience_s=patience_s
    ):
        journal.add(answer)
        answers[job.task.name] = answer
        tell(len(answers), len(work), "answers")
    return {job.task.name: answers[job.task.name] for job in work}


def _oracles(
    place: Path,
    work: Sequence[CaseTask],
    truths: Mapping[str, Opened],
    given_answers: Mapping[str, dict[str, Any]],
    options: Options,
    executor: ExecutorConfig,
    tell: Progress,
) -> dict[str, dict[str, Any]]:
    """For one effect with a gap beyond tolerance, and for the answers about benches that named an
    effect."""
    journal = CaseJournal(place / _ORACLES)
    oracle_fits = journal.read()
    wanted = [
        task
        for task in work
        if (len(truths[task.name].strengths) == 1 and not truths[task.name].within_tolerance)
        or (task.tier in BENCHES and given_answers[task.name].get("fitted"))
    ]
    requests = [
        oracle_fit.OpenedTask(task, options, tuple(given_answers[task.name].get("fitted", ())))
        for task in wanted
        if task.name not in oracle_fits and "added" not in given_answers[task.name]
    ]
    answers = run_all_tasks(
        executor,
        oracle_fit.oracle,
        requests,
        lost=oracle_fit.oracle_without_answer,
        patience_s=PATIENCE_S,
    )
    for done, (_, fit) in enumerate(answers, start=1):
        journal.add(fit)
        oracle_fits[fit["case"]] = fit
        tell(done, len(requests), "oracles")
    return oracle_fits


def _labels(work: Sequence[CaseTask], executor: ExecutorConfig, tell: Progress) -> list[Opened]:
    """Of every task, in their order: nobody is to tell a case by when it was finished."""
    labels: dict[str, Opened] = {}
    for task, label in run_all_tasks(executor, _labelled, work):
        labels[task.name] = label
        tell(len(labels), len(work), "labels sealed")
    return [labels[task.name] for task in work]


def _labelled(task: CaseTask) -> Opened:
    return label_of(*case_of_task(task))


@contextmanager
def _work_folder(folder: Path | None) -> Iterator[Path]:
    if folder is None:
        with tempfile.TemporaryDirectory(prefix="pyroshock-blind-check-") as name:
            yield Path(name)
        return
    folder.mkdir(parents=True, exist_ok=True)
    yield folder
