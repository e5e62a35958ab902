"""Models trained on a dataset: each is registered as it is finished, under the key of its task, and
found by it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ...training.registry.connection import user_environment
from ...training.registry.model_storage import storage_for
from ...training.registry.records import Trained, Version
from ...training.registry.registry import Registry
from ..jobs.kind import Ending, JobForm, Kind, Result, RunningJob, ending_of

if TYPE_CHECKING:
    from ...training.fitting.session import Session
    from ...training.models.catalogue import Budget


@dataclass(frozen=True)
class TrainArguments:
    """As the options of `pyroshock train`; no `retrain`: a job that is begun again must find what
    it has trained."""

    dataset: str
    models: Sequence[str]
    split: str = "repetitions,configurations"
    seed: int = 0
    budget: Budget = "reduced"


def _do(work: RunningJob, arguments: TrainArguments) -> Ending:
    from ..common.model_registry import models_extra

    with models_extra():
        session = _trained(work, arguments)
    if not session.versions and session.failures:
        raise ValueError(
            "; ".join(
                f"{failure.model} ({failure.split}): {failure.reason}"
                for failure in session.failures
            )
        )
    earlier = len(session.versions) - session.trained
    failed = (
        f"; not trained: {', '.join(failure.model for failure in session.failures)}"
        if session.failures
        else ""
    )
    words = f"{session.trained} trained, {earlier} found as they were trained before{failed}"
    return ending_of(Result("/models", words, _rows(work, arguments, session)))


def _trained(work: RunningJob, arguments: TrainArguments) -> Session:
    from ...training.fitting.session import Progress, train
    from ..common.model_registry import context_of, splits_of
    from ..common.registered_models import note_registered
    from .registered_figures import RegisteredFigures

    registry = FencedRegistry(work)
    context = context_of(
        *(work.store, arguments.dataset, registry, arguments.seed, arguments.budget),
        RegisteredFigures(),
    )
    splits = splits_of(context.table, arguments.split)
    session = train(registry, context, arguments.models, splits, progress=Progress(work.step))
    note_registered(work.store, registry)
    return session


def _rows(work: RunningJob, arguments: TrainArguments, session: Session) -> list[dict[str, object]]:
    from ..common.model_registry import registry_of
    from .tables import json_row

    floors = (
        registry_of(work.db).floors(session.versions[0].dataset.hash, arguments.seed)
        if session.versions
        else {}
    )
    return [json_row(version, floors) for version in session.versions]


def _form(arguments: TrainArguments) -> JobForm:
    fields: dict[str, str | list[str]] = {
        "dataset": arguments.dataset,
        "models": list(arguments.models),
    }
    fields |= {"split": arguments.split, "budget": arguments.budget, "seed": str(arguments.seed)}
    return JobForm("/models/train", "train", fields)


TRAIN = Kind("train", TrainArguments, _do, form=_form)


class FencedRegistry(Registry):
    """Records a model only while the lease is held, and one that was registered meanwhile is not
    registered again.

    MLflow's store is another one than ours, so that both cannot be written in one transaction. What
    is left is a worker that sleeps for a whole lease within these lines, without the lock of its
    dataset (another machine): a version more, with the same model in it.
    """

    def __init__(self, work: RunningJob) -> None:
        super().__init__(storage_for(work.db, user_environment()))
        self._work = work

    def record(self, trained: Trained, session: str | None = None) -> Version:
        with self._work.store.writing():  # raises where the lease is lost
            pass
        registered = next(
            (version for version in self.versions() if version.task_key == trained.task.key), None
        )
        return registered or super().record(trained, session)
