"""The gap of every configuration before and after a correction, in the metric of the report."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from ...array_types import Floats, Rows
from ..means import Means, floors, tolerances
from ..observables.base import Observable, Stage


@dataclass(frozen=True, eq=False)
class Gaps:
    """Mean residuals (C, D) of all stages over `scale` (D,), and the variance (C, D) that repetitions leave of them.

    `chance` (C,): standard deviation that the scatter alone gives to a configuration's mean square. `freedom`: the
    degrees of freedom that measured the scatter.
    """

    observables: tuple[Observable, ...]
    scale: Floats
    mean: Floats
    variance: Floats
    chance: Floats
    freedom: int

    @classmethod
    def of(cls, stages: Sequence[Stage], scales: Mapping[str, Floats] | None = None) -> Self:
        """`scales` (d,) by stage, in the units of its observables; tolerances where none is given.

        An infinite scale leaves an observable out.
        """
        record = stages[0].record
        scale = np.concatenate([(scales or {}).get(stage.name, tolerances(stage.observables)) for stage in stages])
        used = np.isfinite(scale)
        residuals = np.concatenate([stage.residuals() for stage in stages], axis=1)[:, used] / scale[used]
        items = [item for stage in stages for item in stage.observables]
        observables = tuple(items[i] for i in np.flatnonzero(used))
        floor = floors(observables) / scale[used]
        means = Means.of(residuals, record.configuration_of, len(record.configurations), floor)
        chance = _chance(residuals - means.mean[record.configuration_of], means)
        freedom = int(np.isfinite(residuals).any(axis=1).sum() - np.isfinite(means.mean).any(axis=1).sum())
        return cls(observables, scale, means.mean, means.variance, chance, freedom)

    @property
    def rows(self) -> Rows:
        """Configurations that have a gap at all."""
        return np.flatnonzero(np.isfinite(self.mean).any(axis=1))

    def over_scale(self, tables: Floats) -> Floats:
        """(k, C, D): changes (k, C, D') of all observables in their units; zero where there is no answer."""
        used = np.isfinite(self.scale)
        return np.asarray(np.nan_to_num(tables[:, :, used] / self.scale[used]))

    def squares(self, correction: Floats | float = 0.0) -> Floats:
        """(C,): squared gap of each configuration over all of its observables, its scatter included; the mean over the
        configurations is that over all cells, so that one with few cells counts for no more than they do."""
        return _over_observables((self.mean - correction) ** 2)

    @property
    def floor(self) -> Floats:
        """(C,): what the scatter alone gives to `squares`."""
        return _over_observables(np.where(np.isfinite(self.mean), self.variance, np.nan))

    @property
    def floor_error(self) -> float:
        """Relative standard deviation of `floor`, from the number of repetitions that measured it."""
        ratio = self.chance[self.rows] / np.maximum(self.floor[self.rows], 1e-300)
        return float(np.median(ratio) / np.sqrt(self.freedom)) if self.freedom > 0 else 0.0


def _over_observables(values: Floats) -> Floats:
    return np.asarray(np.nansum(values, axis=1) / _mean_count(values))


def _mean_count(values: Floats) -> float:
    """Cells of a configuration with a value, in the mean over the configurations that have any."""
    count = np.isfinite(values).sum(axis=1)
    return float(count[count > 0].mean()) if count.any() else 1.0


def _chance(deviation: Floats, means: Means) -> Floats:
    """sqrt(2 tr(S^2)) / d of the mean's covariance S: observables that scatter together average out less."""
    values = np.nan_to_num(deviation)
    values = values / np.maximum(np.linalg.norm(values, axis=0), 1e-300)
    correlation = values.T @ values
    np.fill_diagonal(correlation, 1.0)
    variance = np.nan_to_num(means.variance)
    trace = np.einsum("ci,ij,cj->c", variance, correlation**2, variance)
    return np.asarray(np.sqrt(2 * trace) / _mean_count(means.mean))
