"""The registry of models in the hands of one attempt at a job."""

from __future__ import annotations

from ...training.registry.connection import user_environment
from ...training.registry.model_storage import place_beside
from ...training.registry.records import Trained, Version
from ...training.registry.registry import Registry
from .work import RunningJob


class FencedRegistry(Registry):
    """Records a model only while the lease is held, and one that was registered meanwhile is not registered again.

    MLflow's store is another one than ours, so that both cannot be written in one transaction. What is left is a worker
    that sleeps for a whole lease within these lines, without the lock of its dataset (another machine): a version more,
    with the same model in it.
    """

    def __init__(self, work: RunningJob) -> None:
        super().__init__(place_beside(work.db, user_environment()))
        self._work = work

    def record(self, trained: Trained, session: str | None = None) -> Version:
        with self._work.store.writing():  # raises where the lease is lost
            pass
        registered = next((version for version in self.versions() if version.task_key == trained.task.key), None)
        return registered or super().record(trained, session)


def fenced_registry_of(work: RunningJob) -> FencedRegistry:
    """The registry beside the job's store, or where MLFLOW_TRACKING_URI says."""
    return FencedRegistry(work)
