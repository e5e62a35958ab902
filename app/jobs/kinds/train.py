"""Models trained on a dataset: each is registered as it is finished, under the key of its task, and found by it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ..work import Ending, Result, RunningJob
from .base import Kind, told

if TYPE_CHECKING:
    from ....training.fitting.session import Session
    from ....training.models.catalogue import Budget


@dataclass(frozen=True)
class TrainArguments:
    """As the options of `pyroshock train`; no `retrain`: a job that is begun again must find what it has trained."""

    dataset: str
    models: Sequence[str]
    split: str = "repetitions,configurations"
    seed: int = 0
    budget: Budget = "reduced"


def _do(work: RunningJob, asked: TrainArguments) -> Ending:
    from ...models.training import models_extra

    with models_extra():
        session = _trained(work, asked)
    if not session.versions and session.failures:
        raise ValueError(
            "; ".join(f"{failure.model} ({failure.split}): {failure.reason}" for failure in session.failures)
        )
    earlier = len(session.versions) - session.trained
    failed = f"; not trained: {', '.join(failure.model for failure in session.failures)}" if session.failures else ""
    words = f"{session.trained} trained, {earlier} found as they were trained before{failed}"
    return told(Result("/models", words, _rows(work, asked, session)))


def _trained(work: RunningJob, asked: TrainArguments) -> Session:
    from ....training.fitting.session import Progress, train
    from ...models.training import ground_of, splits_of
    from ..fenced_registry import fenced_registry_of

    registry = fenced_registry_of(work)
    ground = ground_of(work.store, asked.dataset, registry, asked.seed, asked.budget)
    splits = splits_of(ground.table, asked.split)
    return train(registry, ground, asked.models, splits, progress=Progress(work.step))


def _rows(work: RunningJob, asked: TrainArguments, session: Session) -> list[dict[str, object]]:
    from ...models.tables import json_row
    from ...models.training import registry_of

    floors = registry_of(work.db).floors(session.versions[0].dataset.hash, asked.seed) if session.versions else {}
    return [json_row(version, floors) for version in session.versions]


TRAIN = Kind("train", TrainArguments, _do)
