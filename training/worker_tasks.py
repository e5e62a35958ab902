"""What a training's workers are asked to do."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from .fitting import FittingFailure, Ground, attempted
from .records import Trained
from .tasks import TrainingTask
from .time_search import TimeSettings, searched_time

Outcome = Trained | FittingFailure


@dataclass(frozen=True)
class TaskWithContactTime:
    """A task, and what was found for the contact time of its split."""

    task: TrainingTask
    tuned: Mapping[str, Any] | None = None

    def done(self, ground: Ground) -> Outcome:
        return attempted(self.task, ground, self.tuned)

    def failed(self, reason: str) -> FittingFailure:
        return FittingFailure(self.task.model, self.task.split, reason)


@dataclass(frozen=True)
class TimeSearch:
    """Of what the models of a split share."""

    split: str

    def done(self, ground: Ground) -> TimeSettings | FittingFailure:
        try:
            return searched_time(self.split, ground)
        except ValueError as error:
            return self.failed(str(error))

    def failed(self, reason: str) -> FittingFailure:
        return FittingFailure("contact time", self.split, reason)


Errand = TaskWithContactTime | TimeSearch


def done(errand: Errand, ground: Ground) -> Outcome | TimeSettings:
    """By a worker, which knows it by this name."""
    return errand.done(ground)


def lost(errand: Errand) -> FittingFailure:
    """In the place of what a worker that died would have given."""
    return errand.failed("its process died twice, for memory perhaps; repeat with fewer jobs")
