"""The gap as a table: what was measured less what the nominal simulators say, for each
configuration and observable.

Means over the runs of a configuration, and what their scatter leaves of them.

What repetitions say of the scatter of one run, drawn towards the sensors' data sheets where they
are few.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from ..array_types import Floats, Rows
from .observables.base import Observable, Stage
from .record import CampaignRecord
from .verdict import GapSize


def means(
    residuals: Floats, configuration: Rows, configurations: int
) -> tuple[Floats, NDArray[np.intp]]:
    """Mean over the runs of each configuration (C, D), NaN where there is none, and their number.

    Parameters:
        residuals: A value of each run and observable (R, D), NaN where there is none.
        configuration: The configuration of each run (R,).
        configurations: The number C of configurations.
    """
    finite = np.isfinite(residuals)
    total = np.zeros((configurations, residuals.shape[1]))
    count = np.zeros(total.shape, dtype=np.intp)
    np.add.at(total, configuration, np.where(finite, residuals, 0.0))
    np.add.at(count, configuration, finite.astype(np.intp))
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(count > 0, total / count, np.nan), count


@dataclass(frozen=True, eq=False)
class Means:
    """C configurations by d observables. `mean` and `variance` of that mean (C, d), NaN where no
    run has a value."""

    mean: Floats
    variance: Floats

    @classmethod
    def of(
        cls, values: Floats, configuration: Rows, configurations: int, floor: Floats | float = 0.0
    ) -> Self:
        """Means of runs, and what their scatter leaves of them. The scatter is pooled over
        configurations.

        Parameters:
            values: A value of each run and observable (R, d), NaN where there is none.
            configuration: The configuration of each run (R,).
            configurations: The number C of configurations.
            floor: The scatter of one run where nothing was repeated, one number or one for each
                observable (d,); by default 0.
        """
        mean, count = means(values, configuration, configurations)
        deviation = np.where(np.isfinite(values), values - mean[configuration], 0.0)
        freedom = np.maximum(count - 1, 0).sum(axis=0)
        scatter = np.where(
            freedom > 0, np.sqrt((deviation**2).sum(axis=0) / np.maximum(freedom, 1)), floor
        )
        return cls(mean, np.where(count > 0, scatter**2 / np.maximum(count, 1), np.nan))


def tolerances(observables: Sequence[Observable]) -> Floats:
    """The tolerance of each observable (d,), in its unit.

    Parameters:
        observables: The d observables.
    """
    return np.array([item.tolerance for item in observables], dtype=np.float64)


def floors(observables: Sequence[Observable]) -> Floats:
    """What the data sheets say of one run's scatter (d,), in the unit of each observable.

    Parameters:
        observables: The d observables.
    """
    return np.array([item.floor for item in observables], dtype=np.float64)


#: The data sheet weighs as much as so many degrees of freedom. Few: a bench scatters more than its
#: sensors, and a scatter that is taken too small accuses.
SHEET_WEIGHT = 3.0
#: A configuration scatters more than the others where chance would show as much in one campaign of
#: so many, of any of its configurations; at most so large a share of them does.
_OUTLYING, _MOST_OUTLYING = 1e-3, 0.25
#: Correlations are drawn towards what lines of a channel share on average, and that towards none,
#: as if so many runs for each observable, and for each channel, had shown just that.
PLAIN_WEIGHT = 1.0


@dataclass(frozen=True, eq=False)
class Noise:
    """Scatter of one run: covariance (D, D), and the degrees of freedom (D,) that measured it; 0:
    floor assumed.

    `relative` (C, D) or (1, 1): standard deviation in a configuration over that of the covariance.
    It is larger than one where the variance is an outlier by Cochran's test (ISO 5725-2:2019,
    8.3.3): a shot that hardly leaves the barrel scatters many times as much as others.
    """

    covariance: Floats
    freedom: Floats
    relative: Floats = field(default_factory=lambda: np.ones((1, 1)))

    @property
    def assumed(self) -> bool:
        """Whether no repetition measured it."""
        return not bool((self.freedom > 0).any())

    @classmethod
    def of(
        cls, deviations: Floats, configuration: NDArray[np.intp], observables: Sequence[Observable]
    ) -> Self:
        """The scatter that repetitions show, drawn towards the data sheets.

        Variances: (nu s^2 + nu0 f^2) / (nu + nu0) with f of the data sheets. Correlations pooled
        over observables that a run has both of, times nu / (nu + D), and the rest of the weight to
        their mean over the lines of a channel, with a weight that is fixed since the optimal one is
        itself uncertain with few runs. Drawn towards none, a shot that is louder as a whole would
        count once for each line.

        Parameters:
            deviations: Deviations (R, D) of runs from the mean of their configuration, NaN where
                there is none.
            configuration: The configuration of each run (R,).
            observables: The D observables, whose floors the data sheets give.

        Source:
            Ledoit and Wolf, J. Portfolio Manag. 30 (2004) 110, for the correlations.
        """
        measured = np.isfinite(deviations)
        values = np.where(measured, deviations, 0.0)
        member = np.eye(configuration.max() + 1)[:, configuration]
        count = member @ measured
        freedom = np.maximum(count - 1, 0.0).sum(axis=0)
        sheet = np.array([item.floor for item in observables]) ** 2
        relative = _relative_scatter(member @ values**2, np.maximum(count - 1, 0.0), sheet)
        values = values / relative[configuration]
        squares = (values**2).sum(axis=0)
        sigma = np.sqrt((squares + SHEET_WEIGHT * sheet) / (freedom + SHEET_WEIGHT))
        with np.errstate(invalid="ignore", divide="ignore"):
            correlation = np.nan_to_num((values.T @ values) / np.sqrt(np.outer(squares, squares)))
        np.fill_diagonal(correlation, 1.0)
        typical = float(np.median(freedom))
        share = typical / (typical + PLAIN_WEIGHT * len(observables))
        correlation = share * correlation + (1 - share) * _shared(correlation, observables, typical)
        return cls(correlation * np.outer(sigma, sigma), freedom, relative)


def _relative_scatter(squares: Floats, freedom: Floats, sheet: Floats) -> Floats:
    """(C, D), 1 where the variance is no outlier: sums of squared deviations (C, D), their degrees
    of freedom (C, D), and the variances of the data sheets (D,)."""
    from scipy.stats import f as f_distribution

    relative = np.ones(squares.shape)
    measured = (freedom > 0).sum(axis=0)
    for d in np.flatnonzero(measured > 1):
        inside = freedom[:, d] > 0
        for _ in range(int(_MOST_OUTLYING * measured[d])):
            variance = np.where(inside, squares[:, d] / np.maximum(freedom[:, d], 1.0), -1.0)
            largest = int(variance.argmax())
            rest = inside & (np.arange(len(inside)) != largest)
            rest_freedom = freedom[rest, d].sum() + SHEET_WEIGHT
            pooled = (squares[rest, d].sum() + SHEET_WEIGHT * sheet[d]) / rest_freedom
            chance = f_distribution.sf(
                variance[largest] / pooled, freedom[largest, d], rest_freedom
            )
            if chance * measured[d] > _OUTLYING:
                break
            inside = rest
            drawn = (squares[largest, d] + SHEET_WEIGHT * pooled) / (
                freedom[largest, d] + SHEET_WEIGHT
            )
            relative[largest, d] = max(np.sqrt(drawn / pooled), 1.0)
    return relative


def _shared(correlation: Floats, observables: Sequence[Observable], freedom: float) -> Floats:
    """(D, D): mean correlation of the lines of each channel, with each other and with all else; one
    on the diagonal."""
    # What is no line stands alone.
    keys = [
        (o.stage, o.channel, o.unit, i if o.frequency_hz is None else -1)
        for i, o in enumerate(observables)
    ]
    names = list(dict.fromkeys(keys))
    member = np.array([[key == name for name in names] for key in keys], dtype=np.float64)
    count = member.sum(axis=0)
    mean = member.T @ (correlation - np.eye(len(keys))) @ member
    mean /= np.outer(count, count) - np.diag(count) + np.diag(count == 1)
    mean *= freedom / (freedom + PLAIN_WEIGHT * len(names))
    mean[np.diag_indices(len(names))] = np.where(count == 1, 1.0, np.maximum(np.diag(mean), 0.0))
    values, vectors = np.linalg.eigh(mean)
    mean = (vectors * np.maximum(values, 0.0)) @ vectors.T
    size = np.sqrt(np.maximum(np.diag(mean), 1.0))
    shared = member @ (mean / np.outer(size, size)) @ member.T
    np.fill_diagonal(shared, 1.0)
    return np.asarray(shared)


#: Of one dB.
_NEPER = float(np.log(10)) / 20


@dataclass(frozen=True, eq=False)
class GapTable:
    """C configurations of a record by D observables of all its stages.

    `residuals` (R, D) of every run, NaN where it has none; `mean` (C, D) over the runs of a
    configuration, `count` (C, D) of them; `noise` of one run. `nuisances` (q, C, D): what one
    standard deviation of each nominal parameter that is declared uncertain does. `loudness` (C,) by
    stage: the logarithm of how hard the nominal simulator says the configurations are, NaN without
    an answer.
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
    def of(
        cls,
        record: CampaignRecord,
        stages: Sequence[Stage],
        widened: Mapping[str, float] | None = None,
    ) -> Self:
        """The gap of a campaign.

        Parameters:
            record: The campaign.
            stages: Its stages, in the order of the bench.
            widened: Factors on the tolerances, by the name of the stage; by default tolerances stay
                as they are.

        Raises:
            ValueError: Where nothing can be compared.
        """
        factor = widened or {}
        items = [item for stage in stages for item in stage.observables]
        observables = tuple(
            replace(item, tolerance=item.tolerance * factor.get(item.stage, 1.0)) for item in items
        )
        residuals = np.concatenate([stage.residuals() for stage in stages], axis=1)
        mean, count = means(residuals, record.configuration_of, len(record.configurations))
        if not count.any():
            raise ValueError(
                f"campaign {record.name}: no run has both "
                f"a measured and a simulated value to compare"
            )
        noise = Noise.of(
            residuals - mean[record.configuration_of], record.configuration_of, observables
        )
        loudness = {stage.name: _loudness(stage, record) for stage in stages}
        return cls(
            record,
            observables,
            residuals,
            mean,
            count,
            noise,
            _nuisances(stages, mean.shape),
            loudness,
        )

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
        """The places of a stage's observables in the table.

        Parameters:
            stage: The name of the stage.
        """
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


_NAMES = {
    "gun": "rms error of velocity (natural logarithm)",
    "contact": "rms error of the pulse's peak, impulse and width (natural logarithm)",
    "plate": "rms error of the shock response spectrum (dB)",
}
#: What makes the number; stages with more observables than these have them for telling causes
#: apart.
_CONTACT = ("ln_peak", "ln_impulse", "ln_width_half")


@dataclass(frozen=True, eq=False)
class GapMetric:
    """`columns` (m,) of the gap table, each over `unit` (m,): 1 where one unit serves all,
    tolerances otherwise, such that each of several stages counts the same, however many observables
    it has."""

    name: str
    columns: NDArray[np.intp]
    unit: Floats
    tolerance: float

    @classmethod
    def of(cls, gap: GapTable) -> Self:
        """One stage in its own unit, several in tolerances; a plate without spectra by its modes,
        in tolerances.

        Parameters:
            gap: The gap that is to be measured.
        """
        spectra = any(item.unit == "dB" for item in gap.observables)
        columns = metric_columns(gap.observables)
        tolerance = gap.tolerance[columns]
        if gap.stages == ("plate",) and not spectra:
            return cls(
                "rms error of modal frequencies and damping ratios (in tolerances)",
                columns,
                tolerance,
                1.0,
            )
        if len(gap.stages) == 1:
            return cls(
                _NAMES[gap.stages[0]],
                columns,
                np.ones(columns.size),
                float(np.sqrt(np.mean(tolerance**2))),
            )
        name = f"rms error of {', '.join(gap.stages)} (in tolerances, all stages alike)"
        return cls(name, columns, tolerance * np.sqrt(_stage_counts(gap, columns)), 1.0)

    def weights(self, gap: GapTable) -> Floats:
        """(D,): of the squares of all observables in tolerances; 0 where one does not count, the
        others' mean is 1.

        Parameters:
            gap: The gap whose observables are weighed.
        """
        weight = np.zeros(len(gap.observables))
        weight[self.columns] = 1 / _stage_counts(gap, self.columns)
        return weight

    def scales(self, gap: GapTable) -> dict[str, Floats]:
        """By stage (d,): the unit of each observable; infinite where it does not count.

        Parameters:
            gap: The gap whose observables are scaled.
        """
        unit = np.full(len(gap.observables), np.inf)
        unit[self.columns] = self.unit
        return {name: unit[gap.columns(name)] for name in gap.stages}

    def rms(self, table: Floats) -> float:
        """Root mean square of a table, over the cells that there are.

        Parameters:
            table: Values (C, D) in the units of the observables; NaN where there is no cell.
        """
        return float(np.sqrt(np.nanmean((table[:, self.columns] / self.unit) ** 2)))

    def size(self, gap: GapTable) -> GapSize:
        """How large a gap is, in the unit of the metric.

        Parameters:
            gap: The gap that is measured.
        """
        before, floor = self.rms(gap.mean), self.rms(np.sqrt(gap.floor_variance))
        return GapSize(
            self.name, before, floor, self.tolerance, max(self.by_stage(gap).values()) > 1.0
        )

    def by_stage(self, gap: GapTable) -> dict[str, float]:
        """By stage: rms of what is above the noise floor, in tolerances; 0 where a stage has no
        cell.

        Parameters:
            gap: The gap that is measured.
        """
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


def metric_columns(observables: Sequence[Observable]) -> NDArray[np.intp]:
    """The places of those observables that the size of the gap counts.

    Parameters:
        observables: The observables of all stages (D,).
    """
    spectra = any(item.unit == "dB" for item in observables)
    return np.flatnonzero([_counts(item, spectra) for item in observables])


def _counts(item: Observable, spectra: bool) -> bool:
    if item.stage == "contact":
        return item.name in _CONTACT
    if item.stage == "gun":
        return item.channel == "velocity"
    return item.unit == "dB" or not spectra
