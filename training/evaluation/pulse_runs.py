"""Pulses by the run that they are of."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from ...dataset.table import PulseTable, Texts


@dataclass(frozen=True, eq=False)
class PulseRuns:
    """The k runs of n pulses, in run order: `member` (n,) is the place of a pulse's run, `tip` and
    `label` are (k,)."""

    member: NDArray[np.intp]
    tip: Texts
    label: Texts

    def __len__(self) -> int:
        return len(self.tip)

    def mean(self, values: Floats) -> Floats:
        """Mean of pulses' values (n,) by test, (k,)."""
        counts = np.bincount(self.member, minlength=len(self))
        return np.asarray(np.bincount(self.member, values, len(self)) / counts)


def runs_of(pulses: PulseTable) -> PulseRuns:
    """Runs by campaign and number."""
    order = np.lexsort((pulses.run, pulses.campaign))
    campaign, run = pulses.campaign[order], pulses.run[order]
    new = np.ones(len(order), dtype=bool)
    new[1:] = (campaign[1:] != campaign[:-1]) | (run[1:] != run[:-1])
    member = np.empty(len(order), dtype=np.intp)
    member[order] = np.cumsum(new) - 1
    many = len(np.unique(campaign)) > 1
    label = [
        f"{name} {number}" if many else str(number)
        for name, number in zip(campaign[new], run[new], strict=True)
    ]
    return PulseRuns(member, pulses.tip_material[order][new], np.array(label))
