"""What all runs of a case share."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from .background import background
from .case import TOLERANCES, Case
from .designs import CaseSetting, design
from .order import run_order
from .unknown_effects import UnknownEffect


@dataclass(frozen=True, eq=False)
class CaseRuns:
    """What all runs of a case share; `rows` (R, 2) of configuration and repetition, `order` (R,) from 0 to 1."""

    case: Case
    plan: tuple[CaseSetting, ...]
    rows: NDArray[np.int64]
    order: Floats
    outside: UnknownEffect

    @classmethod
    def of(cls, case: Case) -> CaseRuns:
        """Those of a case."""
        plan, rows = design(case.kind, case.design), run_order(case)
        return cls(case, plan, rows, np.linspace(0, 1, len(rows)), UnknownEffect(case.unknown or "", case.amount, plan))

    @property
    def which(self) -> NDArray[np.int64]:
        return np.asarray(self.rows[:, 0])

    @property
    def settings(self) -> list[CaseSetting]:
        return [self.plan[c] for c in self.which]

    def spread(self, stage: str) -> float:
        """Standard deviation of one run, in the stage's unit."""
        return float(self.case.floor * TOLERANCES[stage] * self.case.repetitions**0.5)

    def background(self, count: int, stream: str) -> Floats:
        """(R, count), in tolerances."""
        return background(self.case.background, self.plan, count, stream)[self.which]
