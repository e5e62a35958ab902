"""What acts in a case, as the stages take it."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np

from ...array_types import Floats
from .designs import CaseSetting
from .unknown_effects import UnknownEffect


@dataclass(frozen=True)
class ActingCause:
    """What acts: effects of the catalogue, by strength, and a family outside of it.

    `order` (C,): places of the configurations in the order of runs, 0 to 1; evenly spread where it is empty. `laws`:
    the split of the second laws by which the effects act, empty for the bench's own.
    """

    strengths: tuple[tuple[str, float], ...] = ()
    family: str = ""
    amount: float = 0.0
    order: tuple[float, ...] = ()
    laws: str = ""

    def restricted(self, names: Collection[str]) -> ActingCause:
        """With these of its effects alone."""
        return replace(self, strengths=tuple((name, value) for name, value in self.strengths if name in names))

    @property
    def table(self) -> dict[str, float]:
        return dict(self.strengths)

    def places(self, count: int) -> Floats:
        return np.array(self.order) if self.order else np.linspace(0, 1, count)

    def outside(self, plan: tuple[CaseSetting, ...]) -> UnknownEffect:
        return UnknownEffect(self.family, self.amount, plan)

    def touches(self, *beginnings: str) -> bool:
        """Whether the name of something that acts begins with one of these."""
        return any(name.startswith(beginnings) for name in (*self.table, self.family))
