"""How large a gap is, as one number."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from ..array_types import Floats
from .gap import GapTable
from .observables.base import Observable
from .verdict import GapSize

_NAMES = {
    "gun": "rms error of velocity (natural logarithm)",
    "contact": "rms error of the pulse's peak, impulse and width (natural logarithm)",
    "plate": "rms error of the shock response spectrum (dB)",
}
#: What makes the number; stages with more observables than these have them for telling causes apart.
_CONTACT = ("ln_peak", "ln_impulse", "ln_width_half")


@dataclass(frozen=True, eq=False)
class GapMetric:
    """`columns` (m,) of the gap table, each over `unit` (m,): 1 where one unit serves all, tolerances otherwise, such
    that each of several stages counts the same, however many observables it has."""

    name: str
    columns: NDArray[np.intp]
    unit: Floats
    tolerance: float

    @classmethod
    def of(cls, gap: GapTable) -> Self:
        """One stage in its own unit, several in tolerances; a plate without spectra by its modes, in tolerances."""
        spectra = any(item.unit == "dB" for item in gap.observables)
        columns = np.flatnonzero([_counts(item, spectra) for item in gap.observables])
        tolerance = gap.tolerance[columns]
        if gap.stages == ("plate",) and not spectra:
            return cls("rms error of modal frequencies and damping ratios (in tolerances)", columns, tolerance, 1.0)
        if len(gap.stages) == 1:
            return cls(_NAMES[gap.stages[0]], columns, np.ones(columns.size), float(np.sqrt(np.mean(tolerance**2))))
        name = f"rms error of {', '.join(gap.stages)} (in tolerances, all stages alike)"
        return cls(name, columns, tolerance * np.sqrt(_stage_counts(gap, columns)), 1.0)

    def weights(self, gap: GapTable) -> Floats:
        """(D,): of the squares of all observables in tolerances; 0 where one does not count, the others' mean is 1."""
        weight = np.zeros(len(gap.observables))
        weight[self.columns] = 1 / _stage_counts(gap, self.columns)
        return weight

    def scales(self, gap: GapTable) -> dict[str, Floats]:
        """By stage (d,): the unit of each observable; infinite where it does not count."""
        unit = np.full(len(gap.observables), np.inf)
        unit[self.columns] = self.unit
        return {name: unit[gap.columns(name)] for name in gap.stages}

    def rms(self, table: Floats) -> float:
        """Of a table (C, D), over the cells that there are."""
        return float(np.sqrt(np.nanmean((table[:, self.columns] / self.unit) ** 2)))

    def size(self, gap: GapTable) -> GapSize:
        before, floor = self.rms(gap.mean), self.rms(np.sqrt(gap.floor_variance))
        return GapSize(self.name, before, floor, self.tolerance, max(self.by_stage(gap).values()) > 1.0)

    def by_stage(self, gap: GapTable) -> dict[str, float]:
        """By stage: rms of what is above the noise floor, in tolerances; 0 where a stage has no cell."""
        sizes = {}
        excess = (gap.mean**2 - gap.floor_variance) / gap.tolerance**2
        for name in gap.stages:
            cells = excess[:, np.intersect1d(gap.columns(name), self.columns)]
            cells = cells[np.isfinite(cells)]
            sizes[name] = float(np.sqrt(max(0.0, cells.mean()))) if cells.size else 0.0
        return sizes


def _stage_counts(gap: GapTable, columns: NDArray[np.intp]) -> Floats:
    """(m,): observables of a column's own stage, over the mean of that number over the stages."""
    stage = np.array([gap.observables[int(column)].stage for column in columns])
    names, row, count = np.unique(stage, return_inverse=True, return_counts=True)
    return np.asarray(count[row] * len(names) / columns.size, dtype=np.float64)


def _counts(item: Observable, spectra: bool) -> bool:
    if item.stage == "contact":
        return item.name in _CONTACT
    return item.stage != "plate" or item.unit == "dB" or not spectra
