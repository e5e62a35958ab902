"""One training: fit on one side of a split, judge on the other."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..dataset.domain import Domain
from ..dataset.splits import split_of
from ..dataset.table import PulseTable
from ..parallel.executor import HERE, Crew
from .metrics.errors import PulseErrors, pulse_errors
from .metrics.summary import summary
from .model_catalogue import Budget, Making, entry_of
from .models.base import ContactPrediction
from .models.serialization import pack, unpack
from .records import Cost, DatasetName, HeldOutPredictions, Trained
from .resources import metered
from .tasks import TrainingTask, rng_of


@dataclass(frozen=True, eq=False)
class Ground:
    """What all trainings of one call share. `work` holds what is in progress."""

    dataset: DatasetName
    table: PulseTable
    seed: int
    budget: Budget
    work: Path


@dataclass(frozen=True)
class FittingFailure:
    """A model that could not learn from the dataset, and why."""

    model: str
    split: str
    reason: str


def task_of(model: str, split: str, ground: Ground) -> TrainingTask:
    """The training that this would be."""
    settings = entry_of(model).make(Making(budget=ground.budget)).settings()
    return TrainingTask(model, settings, ground.dataset.hash, split, ground.seed)


def fitted(
    task: TrainingTask,
    ground: Ground,
    tuned: Mapping[str, Any] | None = None,
    tell: Callable[[str], None] | None = None,
    crew: Crew = HERE,
) -> Trained:
    """Train and judge. What was fitted is packed and unpacked before it is judged: the figures are of what is stored.

    `tuned` are the contact-time process's settings where they were found already; `crew` does what a model's own
    search tries, and `tell` hears of it. Raises `ValueError` where the model cannot learn from this dataset.
    """
    split = split_of(ground.table, task.split, task.seed)
    training, held_out = ground.table.take(split.train), ground.table.take(split.test)
    model = entry_of(task.model).make(Making(ground.budget, tuned, journal_of(task, ground), tell, crew))
    with metered() as meter:
        model.fit(training, task.rng)
    packed = pack(model)
    prediction = unpack(*packed).predict(held_out.inputs)
    errors = pulse_errors(held_out, prediction)
    rng = rng_of("bootstrap", task.dataset_hash, task.split, task.seed)
    return Trained(
        task=task,
        dataset=ground.dataset,
        packed=packed,
        predictors=training.predictors,
        domain=Domain.of(training),
        held_out=HeldOutPredictions(held_out.key, prediction, training.key),
        metrics=summary(errors, held_out.configuration, rng),
        cost=Cost(meter.seconds, meter.peak_memory_mb),
        figures=_figures(task.model, held_out, prediction, errors),
        fit_report=model.fit_report(),
    )


def attempted(
    task: TrainingTask,
    ground: Ground,
    tuned: Mapping[str, Any] | None = None,
    tell: Callable[[str], None] | None = None,
    crew: Crew = HERE,
) -> Trained | FittingFailure:
    """`fitted`, where a model that cannot learn from this dataset is no reason to stop."""
    try:
        return fitted(task, ground, tuned, tell, crew)
    except ValueError as error:
        return FittingFailure(task.model, task.split, str(error))


def journal_of(task: TrainingTask, ground: Ground) -> Path:
    """Where a search of this task keeps what it has done; gone once the model is registered."""
    return ground.work / f"{task.key}.journal"


def _figures(model: str, held_out: PulseTable, prediction: ContactPrediction, errors: PulseErrors) -> dict[str, bytes]:
    from .plots.by_test import by_test
    from .plots.heat_map import heat_map
    from .plots.pulses import pulse_grid
    from .rendering import png

    named = {model: errors}
    return {
        "pulses.png": png(pulse_grid(held_out, prediction)),
        "nrmse_by_test.png": png(heat_map(held_out, named)),
        "cost_by_test.png": png(by_test(held_out, named, "cost")),
        "impulse_error_by_test.png": png(by_test(held_out, named, "impulse_error")),
    }
