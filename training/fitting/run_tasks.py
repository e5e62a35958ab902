"""What comes of trainings: here, in processes of their own, or on a cluster.

What a training's workers are asked to do.

The Bayesian optimisation of the contact-time process: once for all models of a split.
"""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from ...dataset.table import PulseTable, split_of
from ...parallel.executor import ExecutorConfig
from ...parallel.map_tasks import run_all_tasks
from ...parallel.task import one_thread
from ..estimators.base import FitReport
from ..models.catalogue import entry_of
from ..models.training_task import TRAINING_VERSION, TrainingTask, rng_of
from ..registry.records import Trained
from ..tuning.trials import SettingsSearch, searches_from
from .fitting import FittingFailure, TrainingContext, try_fit
from .training_share import TrainingShare


@dataclass(frozen=True)
class TimeSettings:
    """What was found for the contact time of a split's training pulses, how long it took, and how
    the search went.

    `histories` and `searches` are those of `FitReport`. A file of older software has none.
    """

    tuned: Mapping[str, Any]
    seconds: float
    histories: Mapping[str, Sequence[float]] = field(default_factory=dict)
    searches: Mapping[str, SettingsSearch] = field(default_factory=dict)

    @property
    def report(self) -> FitReport:
        """What a model that shares the search says of it beside its own training."""
        report = FitReport(
            {"search_seconds": self.seconds}, histories=self.histories, searches=self.searches
        )
        return report.under("time")


def search_contact_time(split: str, context: TrainingContext) -> TimeSettings:
    """Raises `ValueError` where nothing can be learned from the split."""
    training = context.table.take(split_of(context.table, split, context.seed).train)
    return _searched(training, rng_of("contact-time", context.dataset.hash, split, context.seed))


def read_time_settings(split: str, context: TrainingContext) -> TimeSettings | None:
    """What was found earlier."""
    try:
        document = json.loads(_file(split, context).read_text(encoding="utf-8"))
        return TimeSettings(**{**document, "searches": searches_from(document.get("searches", {}))})
    except (OSError, ValueError, TypeError, KeyError, AttributeError):
        return None  # not there, or not what we write


def write_time_settings(settings: TimeSettings, split: str, context: TrainingContext) -> None:
    """For the next training on this split."""
    replace_text(_file(split, context), json.dumps(asdict(settings)))


def _file(split: str, context: TrainingContext) -> Path:
    of = f"{context.dataset.hash[:16]}-{split.replace('/', '_')}-{context.seed}-v{TRAINING_VERSION}"
    return context.work / f"contact-time-{of}.json"


def _searched(pulses: PulseTable, rng: np.random.Generator) -> TimeSettings:
    from ..estimators.contact_time import ContactTimeProcess

    begun = time.perf_counter()
    process = ContactTimeProcess()
    process.fit(pulses.x, pulses.contact_time_s[:, np.newaxis], pulses.configuration, rng)
    assert process.tuned_ is not None
    report = process.fit_report()
    return TimeSettings(
        process.tuned_, time.perf_counter() - begun, report.histories, report.searches
    )


def replace_text(file: Path, text: str) -> None:
    """Write so that a reader, or whoever comes after a kill, sees the old file or the whole new
    one."""
    file.parent.mkdir(parents=True, exist_ok=True)
    beside = file.with_name(f"{file.name}.{os.getpid()}")
    beside.write_text(text, encoding="utf-8")
    beside.replace(file)


Outcome = Trained | FittingFailure


@dataclass(frozen=True)
class TaskWithContactTime:
    """A task, and what was found for the contact time of its split."""

    task: TrainingTask
    tuned: Mapping[str, Any] | None = None

    def done(self, context: TrainingContext) -> Outcome:
        return try_fit(self.task, context, self.tuned)

    def failed(self, reason: str) -> FittingFailure:
        return FittingFailure(self.task.model, self.task.split, reason)


@dataclass(frozen=True)
class TimeSearch:
    """Of what the models of a split share."""

    split: str

    def done(self, context: TrainingContext) -> TimeSettings | FittingFailure:
        try:
            return search_contact_time(self.split, context)
        except ValueError as error:
            return self.failed(str(error))

    def failed(self, reason: str) -> FittingFailure:
        return FittingFailure("contact time", self.split, reason)


Errand = TaskWithContactTime | TimeSearch


def done(errand: Errand, context: TrainingContext) -> Outcome | TimeSettings:
    """By a worker, which knows it by this name."""
    return errand.done(context)


def failure_of_lost_worker(errand: Errand) -> FittingFailure:
    """In the place of what a worker that died would have given."""
    return errand.failed("its process died twice, for memory perhaps; repeat with fewer jobs")


Step = Callable[[int, int, str], None]
Tell = Callable[[str], None]
#: Of each split: what its models share, or why there is none.
Times = dict[str, TimeSettings | FittingFailure]


def run_trainings(
    tasks: Sequence[TrainingTask],
    context: TrainingContext,
    executor: ExecutorConfig,
    step: Step,
    tell: Tell,
) -> Iterator[tuple[TrainingTask, Outcome]]:
    """Each task with what came of it, as it is finished. What a training comes to does not depend
    on the executor."""
    times: Times = {}
    searches = list[TimeSearch]()
    for split in dict.fromkeys(task.split for task in tasks if entry_of(task.model).shares_time):
        if (settings := read_time_settings(split, context)) is None:
            searches.append(TimeSearch(split))
        else:
            times[split] = settings
    splits = [search.split for search in searches]
    share = TrainingShare(step, tasks, splits, context.budget, executor.jobs)

    def heard(task: TrainingTask, done: int, total: int, words: str) -> None:
        share.generation(task, done, total)
        tell(words)

    for errand, outcome in _outcomes(tasks, searches, times, context, executor, heard):
        if isinstance(errand, TimeSearch):
            share.searched(errand.split)
        else:
            assert not isinstance(outcome, TimeSettings)
            yield errand, outcome
            share.trained(errand)


def _outcomes(
    tasks: Sequence[TrainingTask],
    searches: Sequence[TimeSearch],
    times: Times,
    context: TrainingContext,
    executor: ExecutorConfig,
    heard: Callable[[TrainingTask, int, int, str], None],
) -> Iterator[tuple[TrainingTask | TimeSearch, Outcome | TimeSettings]]:
    """First what stands alone, and the searches that others wait for, whose results `times` gets;
    then the others.

    Models that search are last and are fitted in this process, which keeps their journals: the
    executor tries their candidates, and `heard` is told of each generation.
    """
    sharing = [task for task in tasks if entry_of(task.model).shares_time]
    alone = [TaskWithContactTime(task) for task in tasks if task not in sharing]
    yield from _first(alone, searches, times, context, executor)
    ready = list[TaskWithContactTime]()
    for task in sharing:
        contact_time = times[task.split]
        if isinstance(contact_time, FittingFailure):
            yield task, FittingFailure(task.model, task.split, contact_time.reason)
        else:
            ready.append(TaskWithContactTime(task, contact_time.tuned))
    searching = [training for training in ready if entry_of(training.task.model).searches]
    elsewhere = [training for training in ready if training not in searching]
    for sent, outcome in run_all_tasks(
        executor, done, elsewhere, shared=(context,), lost=failure_of_lost_worker
    ):
        assert not isinstance(outcome, TimeSettings)
        yield sent.task, _with_search(outcome, times)
    for training in searching:
        with one_thread():
            outcome = try_fit(
                *(training.task, context, training.tuned, partial(heard, training.task)), executor
            )
        yield training.task, _with_search(outcome, times)


def _with_search(outcome: Outcome, times: Times) -> Outcome:
    """A training that shares a search reports how that went, as if it had searched itself."""
    if isinstance(outcome, FittingFailure):
        return outcome
    time = times[outcome.task.split]
    assert isinstance(time, TimeSettings)
    return replace(outcome, fit_report=time.report.joined(outcome.fit_report))


def _first(
    alone: Sequence[TaskWithContactTime],
    searches: Sequence[TimeSearch],
    times: Times,
    context: TrainingContext,
    executor: ExecutorConfig,
) -> Iterator[tuple[TrainingTask | TimeSearch, Outcome | TimeSettings]]:
    """Trainings that need nothing, and `times` of the splits that are searched."""
    # The dear ones first where there are others to work meanwhile, and last where the first results
    # would wait.
    errands: list[Errand] = [*alone, *searches] if executor.is_here else [*searches, *alone]
    for errand, result in run_all_tasks(
        executor, done, errands, shared=(context,), lost=failure_of_lost_worker
    ):
        if isinstance(errand, TaskWithContactTime):
            yield errand.task, result
            continue
        assert isinstance(result, TimeSettings | FittingFailure)
        times[errand.split] = result
        if isinstance(result, TimeSettings):
            write_time_settings(result, errand.split, context)
        yield errand, result
