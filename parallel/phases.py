"""Progress of work whose phases differ in cost, on one scale from nothing to all of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

#: Called with (done, total, what).
Progress = Callable[[int, int, str], None]
#: All of the work, in its hundredths.
WHOLE = 100


class Phases:
    """Tells the progress of phases that follow each other, weighted by what they cost.

    `done` of `WHOLE` never falls, so that an estimate of the remaining time can rest on it.
    """

    def __init__(self, progress: Progress, costs: Mapping[str, float]) -> None:
        """Parameters:
        progress: Receives (done, `WHOLE`, what is being done).
        costs: What each phase costs, in any unit, in their order. Phases that are left out cost
            nothing.
        """
        self._progress, self._costs = progress, costs

    def of(self, phase: str) -> Progress:
        """Receives the steps of one phase, as the phase counts them.

        Parameters:
            phase: One of the phases. Raises `KeyError` for another.
        """
        cost = self._costs[phase]
        names = list(self._costs)
        cost_before = sum(self._costs[name] for name in names[: names.index(phase)])
        return partial(self._step, cost_before, cost)

    def begin(self, phase: str) -> None:
        """Tells that a phase begins, of which no steps are told.

        Parameters:
            phase: One of the phases. Raises `KeyError` for another.
        """
        self.of(phase)(0, 1, phase)

    def _step(self, before: float, cost: float, done: int, total: int, what: str) -> None:
        whole_cost = sum(self._costs.values())
        share = before + cost * (done / total if total else 0.0)
        self._progress(round(WHOLE * share / whole_cost), WHOLE, what)
