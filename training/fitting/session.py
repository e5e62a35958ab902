"""Training models on splits of a dataset: one after the other, or some at once; what is done is not
done again.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from ...parallel.executor import HERE, ExecutorConfig
from ..evaluation.floor import floor_text
from ..registry.evaluate import evaluate_held_out
from ..registry.intact_models import intact_versions
from ..registry.listing import newest
from ..registry.locks import exclusive_lock
from ..registry.records import Trained, Version
from ..registry.registry import Registry
from .fitting import FittingFailure, TrainingContext, journal_of, task_of
from .run_tasks import run_trainings


@dataclass
class Session:
    """What a session came to: versions in the order asked for, whether just trained or found."""

    versions: list[Version] = field(default_factory=list)
    failures: list[FittingFailure] = field(default_factory=list)
    trained: int = 0


def _silent(*_: object) -> None:
    pass


@dataclass(frozen=True)
class Progress:
    """Whom to tell: `step(done, total, what)` as work proceeds, `tell(text)` what is worth a
    line."""

    step: Callable[[int, int, str], None] = _silent
    tell: Callable[[str], None] = _silent


def train(
    registry: Registry,
    context: TrainingContext,
    models: Sequence[str],
    splits: Sequence[str],
    *,
    retrain: bool = False,
    executor: ExecutorConfig = HERE,
    progress: Progress = Progress(),
) -> Session:
    """Train every model on every split, and register each as soon as it is finished.

    A training whose result is registered (same dataset, split, seed, settings and
    `TRAINING_VERSION`) is not done again, so that an interrupted session goes on when it is started
    again. Another process that trains on the same dataset is waited for.

    Parameters:
        registry: Where models are found and registered. This process alone registers.
        context: What all trainings share: the dataset with its pulses, the seed, the budget of a
            search and the folder of work in progress.
        models: Names of models of `models.catalogue`.
        splits: Texts of splits, such as "configurations" (`dataset.table.split_of`).
        retrain: Whether a training is done again although its result is registered; by default
            False.
        executor: Where the models are trained, and by how many processes; by default in this
            process.
        progress: Receives the steps that are done, and messages; by default nobody is told.

    Returns:
        The versions in the order of the splits and models, the models that could not be trained,
        and how many were trained now.
    """
    tasks = [task_of(model, split, context) for split in splits for model in models]

    def waiting() -> None:
        progress.tell("another process trains on this dataset; waiting for it")

    with exclusive_lock(registry.place, f"training {context.dataset.hash[:16]}", waiting):
        trained_before = (
            {}
            if retrain
            else _newest_trainings(registry, {task.key for task in tasks}, progress.tell)
        )
        registry.close_runs(trained_before.values())
        to_do = [task for task in tasks if task.key not in trained_before]
        session = Session()
        summed_up = registry.floors(context.dataset.hash, context.seed).keys() >= set(splits)
        run = (
            None
            if summed_up and not to_do
            else registry.open_session(context.dataset, context.seed)
        )
        for task, outcome in run_trainings(to_do, context, executor, progress.step, progress.tell):
            if isinstance(outcome, FittingFailure):
                session.failures.append(outcome)
                progress.tell(f"{task.model} not trained on {task.split}: {outcome.reason}")
                continue
            trained_before[task.key] = registry.record(outcome, run)
            session.trained += 1
            journal_of(task, context).unlink(missing_ok=True)
            progress.tell(_training_line(outcome))
        session.versions = [
            trained_before[task.key] for task in tasks if task.key in trained_before
        ]
        if run is not None:
            _sum_up(registry, context, run, splits)
    return session


def _newest_trainings(
    registry: Registry, keys: set[str], tell: Callable[[str], None]
) -> dict[str, Version]:
    """The newest version of each of these trainings; one whose files are damaged is trained
    anew."""
    wanted = [version for version in reversed(registry.versions()) if version.task_key in keys]
    return {version.task_key: version for version in intact_versions(registry, wanted, tell)}


def _training_line(trained: Trained) -> str:
    nrmse = trained.metrics["force_nrmse"].mean
    return (
        f"{trained.task.model}, {trained.task.split}: force NRMSE {nrmse:.4f} in "
        f"{trained.cost.seconds:.1f} s"
    )


def _sum_up(registry: Registry, context: TrainingContext, run: str, splits: Sequence[str]) -> None:
    """What stands over all models, earlier ones too: each split's floor and figures, in the run
    over all trainings."""
    figures: dict[str, bytes] = {}
    floors = {
        split: floor_text(context.table, context.dataset.hash, split, context.seed)
        for split in splits
    }
    versions = newest(
        version
        for version in registry.versions()
        if (version.dataset.hash, version.seed) == (context.dataset.hash, context.seed)
    )
    versions = intact_versions(registry, versions)
    for split in splits:
        of_split = {
            version.name: version for version in reversed(versions) if version.split == split
        }
        if of_split:
            judged = evaluate_held_out(
                registry, list(of_split.values()), lambda _hash: context.table
            )
            if context.figures is not None:
                figures |= context.figures.of_split(judged, split)
    registry.close_session(run, figures, floors)
