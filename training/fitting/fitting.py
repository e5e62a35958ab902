"""One training: fit on one side of a split, judge on the other.

Seconds and memory of a piece of work.

One model on one split of one dataset: what makes it this training and no other.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from ...dataset.domain import Domain
from ...dataset.table import PulseTable, split_of
from ...parallel.executor import HERE, ExecutorConfig
from ..evaluation.metrics import OF_MEAN, PulseErrors, mean_pulse_errors, pulse_errors
from ..evaluation.summary import Estimate, summary
from ..models.base import ContactPrediction
from ..models.catalogue import MODEL_SPECS, Budget, BuildOptions, entry_of
from ..models.serialization import pack, plugin_of, unpack
from ..models.training_task import TrainingTask, rng_of
from ..registry.records import Cost, DatasetName, HeldOutPredictions, Trained

if TYPE_CHECKING:
    from ..registry.evaluate import Evaluation

_STATUS, _RESET = Path("/proc/self/status"), Path("/proc/self/clear_refs")


@dataclass
class Meter:
    """Filled when the work is done."""

    seconds: float = 0.0
    peak_memory_mb: float = 0.0


@contextmanager
def measure_resources() -> Iterator[Meter]:
    """Times the block, and notes the greatest memory that the process held within it.

    Elsewhere than on Linux the greatest since the process began: the system counts no other there.
    """
    meter = Meter()
    with suppress(OSError):
        _RESET.write_text(
            "5"
        )  # proc(5): sets the high-water mark of the resident set to what is resident
    begun = time.perf_counter()
    try:
        yield meter
    finally:
        meter.seconds = time.perf_counter() - begun
        meter.peak_memory_mb = _peak_mb()


def _peak_mb() -> float:
    with suppress(OSError):
        for line in _STATUS.read_text().splitlines():
            if line.startswith("VmHWM:"):
                return float(line.split()[1]) / 1024
    with suppress(ImportError):
        import resource
        import sys

        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        return peak / 2**20 if sys.platform == "darwin" else peak / 1024
    return float("nan")


class TrainingFigures(Protocol):
    """The pictures that stand beside a model in the registry, PNG files by name. Who has a renderer
    makes them; workers get it by pickle."""

    def of_model(
        self,
        model: str,
        held_out: PulseTable,
        prediction: ContactPrediction,
        errors: PulseErrors,
    ) -> dict[str, bytes]:
        """Of one training: `prediction` and `errors` are of the `held_out` pulses row by row."""

    def of_split(self, judged: Evaluation, split: str) -> dict[str, bytes]:
        """Of all models that were trained on a split, side by side."""


@dataclass(frozen=True, eq=False)
class TrainingContext:
    """What all trainings of one call share. `work` holds what is in progress, `figures` makes the
    pictures."""

    dataset: DatasetName
    table: PulseTable
    seed: int
    budget: Budget
    work: Path
    figures: TrainingFigures | None = None


@dataclass(frozen=True)
class FittingFailure:
    """A model that could not learn from the dataset, and why."""

    model: str
    split: str
    reason: str


def task_of(model: str, split: str, context: TrainingContext) -> TrainingTask:
    """The training that this would be."""
    settings = entry_of(model).make(BuildOptions(budget=context.budget)).settings()
    plugin = None if model in MODEL_SPECS else plugin_of(model)
    package = f"{plugin.package} {plugin.version}" if plugin else ""
    return TrainingTask(model, settings, context.dataset.hash, split, context.seed, package)


def fit_task(
    task: TrainingTask,
    context: TrainingContext,
    tuned: Mapping[str, Any] | None = None,
    progress: Callable[[int, int, str], None] | None = None,
    executor: ExecutorConfig = HERE,
) -> Trained:
    """Train and judge. What was fitted is packed and unpacked before it is judged: the figures are
    of what is stored.

    `tuned` are the contact-time process's settings where they were found already; `executor` does
    what a model's own search tries, and `progress` hears of it. Raises `ValueError` where the model
    cannot learn from this dataset.
    """
    split = split_of(context.table, task.split, task.seed)
    training, held_out = context.table.take(split.train), context.table.take(split.test)
    model = entry_of(task.model).make(
        BuildOptions(context.budget, tuned, journal_of(task, context), progress, executor)
    )
    with measure_resources() as meter:
        model.fit(training, task.rng)
    packed = pack(model)
    prediction = unpack(*packed).predict(held_out.inputs)
    errors = pulse_errors(held_out, prediction)
    rng = rng_of("bootstrap", task.dataset_hash, task.split, task.seed)
    return Trained(
        task=task,
        dataset=context.dataset,
        packed=packed,
        predictors=training.predictors,
        domain=Domain.of(training),
        held_out=HeldOutPredictions(held_out.key, prediction, training.key),
        metrics=summary(errors, held_out.configuration, rng) | _of_mean(training, held_out, task),
        cost=Cost(meter.seconds, meter.peak_memory_mb),
        figures={}
        if context.figures is None
        else context.figures.of_model(task.model, held_out, prediction, errors),
        fit_report=model.fit_report(),
    )


def _of_mean(training: PulseTable, held_out: PulseTable, task: TrainingTask) -> dict[str, Estimate]:
    """The force error of the mean pulse, which a model must beat to be usable."""
    errors = mean_pulse_errors(training, held_out)
    rng = rng_of("bootstrap of the mean", task.dataset_hash, task.split, task.seed)
    return {OF_MEAN: summary(errors, held_out.configuration, rng)["force_nrmse"]}


def try_fit(
    task: TrainingTask,
    context: TrainingContext,
    tuned: Mapping[str, Any] | None = None,
    progress: Callable[[int, int, str], None] | None = None,
    executor: ExecutorConfig = HERE,
) -> Trained | FittingFailure:
    """`fit_task`, where a model that cannot learn from this dataset is no reason to stop."""
    try:
        return fit_task(task, context, tuned, progress, executor)
    except ValueError as error:
        return FittingFailure(task.model, task.split, str(error))


def journal_of(task: TrainingTask, context: TrainingContext) -> Path:
    """Where a search of this task keeps what it has done; gone once the model is registered."""
    return context.work / f"{task.key}.journal"
