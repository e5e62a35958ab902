"""Which share of a call's trainings is done, told in hundredths."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from ...parallel.phases import WHOLE
from ..models.catalogue import Budget, search_size
from ..models.training_task import TrainingTask

#: Processor time in s of one training on 1,800 pulses in a process that has trained already; only
#: ratios matter. A model that is not listed counts as `_OTHER_S`.
_COSTS_S = {
    **dict.fromkeys(("hunter", "reed", "hann", "hertz", "hunt-crossley", "tree"), 0.3),
    "linear": 0.5,
    "pls": 1.5,
    "ensemble": 3.0,
    "kernel-ridge": 47.0,
    "svr": 46.0,
    "svr-kernel": 70.0,
    "coregional-gp": 10.0,
    "gp": 19.0,
    "hybrid": 25.0,
    "single-pass": 22.0,
    **dict.fromkeys(("nn-narrow", "nn-medium", "nn-bilayer", "nn-trilayer"), 2.5),
    "nn-wide": 6.0,
}
_OTHER_S = 10.0
#: The same of the search of a split's contact time, and of one network of a genetic search.
_TIME_SEARCH_S, _NETWORK_S = 18.6, 2.0
#: What a later generation costs over the first one: most of its networks were tried before.
_LATER_GENERATION = 0.2
#: Of a training whose settings are searched, what the generations take; its folds, figures and
#: files take the rest.
_SEARCH_SHARE = 0.85


class TrainingShare:
    """Tells how far the trainings of one call are.

    Each training and each search of contact times counts by its processor time: the longest ones
    end last, so that an estimate from their number would promise too much.
    """

    def __init__(
        self,
        step: Callable[[int, int, str], None],
        tasks: Sequence[TrainingTask],
        splits: Sequence[str],
        budget: Budget,
        jobs: int,
    ) -> None:
        """Parameters:
        step: Receives (done, `WHOLE`, what is being done).
        tasks: The trainings.
        splits: The splits whose contact time is searched first.
        budget: The size of genetic searches.
        jobs: How many are done at once.
        """
        self._step, self._jobs = step, jobs
        self._costs_s = {task.key: _cost_s(task.model, budget) for task in tasks}
        self._costs_s |= dict.fromkeys(splits, _TIME_SEARCH_S)
        self._models = len(tasks)
        #: The trainings that are to be done, as people know them, by their keys.
        self._names = {task.key: f"{task.model} ({task.split})" for task in tasks}
        self._ended_s, self._part_s = 0.0, 0.0
        self._tell()

    def trained(self, task: TrainingTask) -> None:
        """A training is over, whatever came of it."""
        del self._names[task.key]
        self._end(task.key)

    def searched(self, split: str) -> None:
        """The search of the contact time of a split is over."""
        self._end(split)

    def generation(self, task: TrainingTask, done: int, total: int) -> None:
        """So many of the generations of a training's search are over, while nothing else is
        trained."""
        share = _SEARCH_SHARE * _generations(done) / _generations(total)
        self._part_s = self._costs_s[task.key] * share
        self._tell()

    def _end(self, key: str) -> None:
        self._ended_s, self._part_s = self._ended_s + self._costs_s[key], 0.0
        self._tell()

    def _tell(self) -> None:
        words = f"{self._models - len(self._names)} of {self._models} models"
        if self._names:
            words += f"; {', '.join(list(self._names.values())[: self._jobs])}"
        whole_s = sum(self._costs_s.values())
        share = (self._ended_s + self._part_s) / whole_s if whole_s else 1.0
        self._step(round(WHOLE * share), WHOLE, words)


def _cost_s(model: str, budget: Budget) -> float:
    size = search_size(model, budget)
    if size is None:
        return _COSTS_S.get(model, _OTHER_S)
    population, generations = size
    return _NETWORK_S * population * _generations(generations + 1) / _SEARCH_SHARE


def _generations(number: int) -> float:
    """What so many generations cost, the first of which has the cost of one."""
    return 1.0 + _LATER_GENERATION * (number - 1)
