"""The gap as a table: what was measured less what the nominal simulators say, for each configuration and observable."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from ..array_types import Floats
from .means import means, tolerances
from .noise import Noise
from .observables.base import Observable, Stage
from .record import CampaignRecord

#: Of one dB.
_NEPER = float(np.log(10)) / 20


@dataclass(frozen=True, eq=False)
class GapTable:
    """C configurations of a record by D observables of all its stages.

    `residuals` (R, D) of every run, NaN where it has none; `mean` (C, D) over the runs of a configuration, `count`
    (C, D) of them; `noise` of one run. `nuisances` (q, C, D): what one standard deviation of each nominal parameter
    that is declared uncertain does. `loudness` (C,) by stage: the logarithm of how hard the nominal simulator says the
    configurations are, NaN without an answer.
    """

    record: CampaignRecord
    observables: tuple[Observable, ...]
    residuals: Floats
    mean: Floats
    count: NDArray[np.intp]
    noise: Noise
    nuisances: Floats
    loudness: Mapping[str, Floats]

    @classmethod
    def of(cls, record: CampaignRecord, stages: Sequence[Stage], widened: Mapping[str, float] | None = None) -> Self:
        """`widened`: a factor on the tolerances of a stage. Raises `ValueError` where nothing can be compared."""
        factor = widened or {}
        items = [item for stage in stages for item in stage.observables]
        observables = tuple(replace(item, tolerance=item.tolerance * factor.get(item.stage, 1.0)) for item in items)
        residuals = np.concatenate([stage.residuals() for stage in stages], axis=1)
        mean, count = means(residuals, record.configuration_of, len(record.configurations))
        if not count.any():
            raise ValueError(f"campaign {record.name}: no run has both a measured and a simulated value to compare")
        noise = Noise.of(residuals - mean[record.configuration_of], record.configuration_of, observables)
        loudness = {stage.name: _loudness(stage, record) for stage in stages}
        return cls(record, observables, residuals, mean, count, noise, _nuisances(stages, mean.shape), loudness)

    @property
    def tolerance(self) -> Floats:
        """(D,)"""
        return tolerances(self.observables)

    @property
    def floor_variance(self) -> Floats:
        """(C, D): variance of each mean that repetitions alone leave; NaN where there is no run."""
        with np.errstate(divide="ignore"):
            variance = np.diag(self.noise.covariance) * self.noise.relative**2 / self.count
        return np.asarray(np.where(self.count > 0, variance, np.nan))

    def columns(self, stage: str) -> NDArray[np.intp]:
        """The observables of a stage."""
        return np.flatnonzero([item.stage == stage for item in self.observables])

    @property
    def stages(self) -> tuple[str, ...]:
        return tuple(dict.fromkeys(item.stage for item in self.observables))


def _nuisances(stages: Sequence[Stage], shape: tuple[int, int]) -> Floats:
    """(q, C, D); the same name in two stages is one parameter, which moves both."""
    changes: dict[str, Floats] = {}
    start = 0
    for stage in stages:
        columns = slice(start, start + len(stage.observables))
        for name, table in stage.nuisances().items():
            changes.setdefault(name, np.zeros(shape))[:, columns] = np.nan_to_num(table)
        start = columns.stop
    return np.array(list(changes.values())).reshape(-1, *shape)


def _loudness(stage: Stage, record: CampaignRecord) -> Floats:
    """(C,): ln of velocity, peak force, or of the lines of the spectrum on their mean."""
    lines = [column for column, item in enumerate(stage.observables) if item.unit == "dB"]
    simulated = stage.measured() - stage.residuals()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # runs without any line
        level = np.nanmean(simulated[:, lines], axis=1) * _NEPER if lines else simulated[:, 0]
    mean, _ = means(np.asarray(level)[:, None], record.configuration_of, len(record.configurations))
    return np.asarray(mean[:, 0])
