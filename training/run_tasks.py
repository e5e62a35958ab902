"""What comes of trainings: here, in processes of their own, or on a cluster."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace

from ..parallel.executor import Crew
from ..parallel.map_tasks import mapped
from ..parallel.threads import one_thread
from .fitting import FittingFailure, Ground, attempted
from .model_catalogue import entry_of
from .tasks import TrainingTask
from .time_search import TimeSettings, keep_time, kept_time
from .worker_tasks import Errand, Outcome, TaskWithContactTime, TimeSearch, done, lost

Step = Callable[[int, int, str], None]
Tell = Callable[[str], None]
#: Of each split: what its models share, or why there is none.
Times = dict[str, TimeSettings | FittingFailure]


def outcomes(
    tasks: Sequence[TrainingTask], ground: Ground, crew: Crew, step: Step, tell: Tell
) -> Iterator[tuple[TrainingTask, Outcome]]:
    """Each task with what came of it, as it is finished. What a training comes to does not depend on the crew."""
    remaining = {task.key: task for task in tasks}

    def show() -> None:
        under_way = ", ".join(f"{task.model} ({task.split})" for task in list(remaining.values())[: crew.jobs])
        step(len(tasks) - len(remaining), len(tasks), under_way)

    show()
    for task, outcome in _outcomes(tasks, ground, crew, tell):
        del remaining[task.key]
        yield task, outcome
        show()


def _outcomes(
    tasks: Sequence[TrainingTask], ground: Ground, crew: Crew, tell: Tell
) -> Iterator[tuple[TrainingTask, Outcome]]:
    """First what stands alone, and the searches that others wait for; then the others.

    Models that search are last and are fitted in this process, which keeps their journals: the crew tries their
    candidates.
    """
    sharing = [task for task in tasks if entry_of(task.model).shares_time]
    alone = [TaskWithContactTime(task) for task in tasks if task not in sharing]
    times: Times = {}
    yield from _first(alone, dict.fromkeys(task.split for task in sharing), times, ground, crew)
    ready = list[TaskWithContactTime]()
    for task in sharing:
        contact_time = times[task.split]
        if isinstance(contact_time, FittingFailure):
            yield task, FittingFailure(task.model, task.split, contact_time.reason)
        else:
            ready.append(TaskWithContactTime(task, contact_time.tuned))
    searching = [training for training in ready if entry_of(training.task.model).searches]
    for task, outcome in _sent([training for training in ready if training not in searching], ground, crew):
        yield task, _with_search(outcome, times)
    for training in searching:
        with one_thread():
            outcome = attempted(training.task, ground, training.tuned, tell, crew)
        yield training.task, _with_search(outcome, times)


def _with_search(outcome: Outcome, times: Times) -> Outcome:
    """A training that shares a search reports how that went, as if it had searched itself."""
    if isinstance(outcome, FittingFailure):
        return outcome
    time = times[outcome.task.split]
    assert isinstance(time, TimeSettings)
    return replace(outcome, fit_report=time.report.joined(outcome.fit_report))


def _first(
    alone: Sequence[TaskWithContactTime], splits: Iterable[str], times: Times, ground: Ground, crew: Crew
) -> Iterator[tuple[TrainingTask, Outcome]]:
    """Trainings that need nothing; on the way `times` of the splits, where they were not found earlier."""
    searches = list[TimeSearch]()
    for split in splits:
        if (kept := kept_time(split, ground)) is None:
            searches.append(TimeSearch(split))
        else:
            times[split] = kept
    # The dear ones first where there are others to work meanwhile, and last where the first results would wait.
    errands: list[Errand] = [*alone, *searches] if crew.is_here else [*searches, *alone]
    for errand, result in mapped(crew, done, errands, shared=(ground,), lost=lost):
        if isinstance(errand, TaskWithContactTime):
            assert not isinstance(result, TimeSettings)
            yield errand.task, result
        else:
            assert isinstance(result, TimeSettings | FittingFailure)
            times[errand.split] = result
            if isinstance(result, TimeSettings):
                keep_time(result, errand.split, ground)


def _sent(
    trainings: Sequence[TaskWithContactTime], ground: Ground, crew: Crew
) -> Iterator[tuple[TrainingTask, Outcome]]:
    for training, outcome in mapped(crew, done, trainings, shared=(ground,), lost=lost):
        assert not isinstance(outcome, TimeSettings)
        yield training.task, outcome
