"""Gap reduction on held-out configurations: everything is chosen inside the fold, and the noise
floor cannot go.

The gap of every configuration before and after a correction, in the metric of the report.
"""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from ..array_types import Floats, Rows
from ..parallel.phases import Progress
from ..training.evaluation.summary import fraction, fraction_interval
from .factor_corner import corner_of_factors
from .gap import Means, floors, tolerances
from .inference.held_out import FoldFit
from .iso18571 import pulse_ratings
from .observables.base import Observable, Stage
from .record import RunConfiguration
from .verdict import CORRECTED, Shrinkage, stage_figure

#: Folds by configuration; with fewer configurations each is held out alone.
_FOLDS = 5


@dataclass(frozen=True, eq=False)
class ConfigurationFolds:
    """`folds`: the configurations held out in turn. `name` as the report says it."""

    name: str
    folds: tuple[Rows, ...]

    @property
    def held_out(self) -> Rows:
        return np.concatenate(self.folds)


def by_configuration(rows: Rows) -> ConfigurationFolds:
    """Folds that hold out configurations in turn, spread at random over the folds, always the same
    way: two methods that hold out the same configurations can be compared.

    Parameters:
        rows: The places of the configurations in the gap table.
    """
    parts = np.array_split(np.random.default_rng(0).permutation(rows), min(_FOLDS, len(rows)))
    return ConfigurationFolds("configuration", tuple(np.sort(part) for part in parts))


def corner(
    configurations: Sequence[RunConfiguration], rows: Rows, size: Floats
) -> ConfigurationFolds | None:
    """The corner of the factor space that extrapolates most (`corner_of_factors`); None where there
    is none.

    Parameters:
        configurations: The C configurations of the record.
        rows: The places of those that have a gap.
        size: How large the gap of each configuration is (C,).
    """
    extrapolated = corner_of_factors([configurations[row].factors for row in rows], size[rows])
    return (
        None
        if extrapolated is None
        else ConfigurationFolds(f"corner: {extrapolated.rule}", (rows[extrapolated.rows],))
    )


@dataclass(frozen=True, eq=False)
class Gaps:
    """Mean residuals (C, D) of all stages over `scale` (D,), and the variance (C, D) that
    repetitions leave of them.

    `chance` (C,): standard deviation that the scatter alone gives to a configuration's mean square.
    `freedom`: the degrees of freedom that measured the scatter.
    """

    observables: tuple[Observable, ...]
    scale: Floats
    mean: Floats
    variance: Floats
    chance: Floats
    freedom: int

    @classmethod
    def of(cls, stages: Sequence[Stage], scales: Mapping[str, Floats] | None = None) -> Self:
        """The gaps of the stages of a campaign.

        Parameters:
            stages: The stages of the campaign.
            scales: What residuals are divided by (d,), by the name of the stage and in the units of
                its observables; an infinite scale leaves an observable out. By default the
                tolerances.
        """
        record = stages[0].record
        scale = _by_stage(stages, scales or {})
        used = np.isfinite(scale)
        residuals = (
            np.concatenate([stage.residuals() for stage in stages], axis=1)[:, used] / scale[used]
        )
        items = [item for stage in stages for item in stage.observables]
        observables = tuple(items[i] for i in np.flatnonzero(used))
        floor = floors(observables) / scale[used]
        means = Means.of(residuals, record.configuration_of, len(record.configurations), floor)
        chance = _chance(residuals - means.mean[record.configuration_of], means)
        freedom = int(
            np.isfinite(residuals).any(axis=1).sum() - np.isfinite(means.mean).any(axis=1).sum()
        )
        return cls(observables, scale, means.mean, means.variance, chance, freedom)

    @property
    def rows(self) -> Rows:
        """Configurations that have a gap at all."""
        return np.flatnonzero(np.isfinite(self.mean).any(axis=1))

    def over_scale(self, tables: Floats) -> Floats:
        """Changes (k, C, D) of the observables that are used, over the scale; zero where there is
        no answer.

        Parameters:
            tables: Changes (k, C, D') of all observables, in their units.
        """
        used = np.isfinite(self.scale)
        return np.asarray(np.nan_to_num(tables[:, :, used] / self.scale[used]))

    def squares(self, correction: Floats | float = 0.0) -> Floats:
        """(C,): squared gap of each configuration over all of its observables, its scatter
        included; the mean over the configurations is that over all cells, so that one with few
        cells counts for no more than they do.

        Parameters:
            correction: What effects add to the simulation, over the scale: (C, D), or one number
                for all cells; by default 0.
        """
        return _over_observables((self.mean - correction) ** 2)

    @property
    def floor(self) -> Floats:
        """(C,): what the scatter alone gives to `squares`."""
        return _over_observables(np.where(np.isfinite(self.mean), self.variance, np.nan))

    @property
    def floor_error(self) -> float:
        """Relative standard deviation of `floor`, from the number of repetitions that measured
        it."""
        ratio = self.chance[self.rows] / np.maximum(self.floor[self.rows], 1e-300)
        return float(np.median(ratio) / np.sqrt(self.freedom)) if self.freedom > 0 else 0.0


def _over_observables(values: Floats) -> Floats:
    return np.asarray(np.nansum(values, axis=1) / _mean_count(values))


def _mean_count(values: Floats) -> float:
    """Cells of a configuration with a value, in the mean over the configurations that have any."""
    count = np.isfinite(values).sum(axis=1)
    return float(count[count > 0].mean()) if count.any() else 1.0


def _chance(deviation: Floats, means: Means) -> Floats:
    """sqrt(2 tr(S^2)) / d of the mean's covariance S: observables that scatter together average out
    less."""
    values = np.nan_to_num(deviation)
    values = values / np.maximum(np.linalg.norm(values, axis=0), 1e-300)
    correlation = values.T @ values
    np.fill_diagonal(correlation, 1.0)
    variance = np.nan_to_num(means.variance)
    trace = np.einsum("ci,ij,cj->c", variance, correlation**2, variance)
    return np.asarray(np.sqrt(2 * trace) / _mean_count(means.mean))


def measure_reduction(
    stages: Sequence[Stage],
    fit: Callable[[Rows], FoldFit],
    rng: np.random.Generator,
    scales: Mapping[str, Floats] | None = None,
    pulses: bool = True,
    stage_tolerances: Mapping[str, Floats] | None = None,
    progress: Progress = lambda *_: None,
) -> list[tuple[Shrinkage, FoldCorrections]]:
    """How far the gap shrinks where it is held out: by configuration in five folds, and once a
    corner of the factor space, where there is one.

    `before` and `after` are rms over held-out configurations and observables of mean residuals over
    `scales`, repetition scatter included. `fraction` is what disappears of what is above the
    scatter's part. It is None where the gap before is not two standard errors of the scatter above
    it: no gap to shrink. Negative: the effects made it worse. `effects` are those that most folds
    chose.

    Parameters:
        stages: The stages of the campaign.
        fit: A function that chooses and fits effects on training configurations (rows of the
            record).
        rng: Random numbers of the intervals.
        scales: What residuals are divided by (d,), by the name of the stage and in the units of its
            observables; an infinite scale leaves an observable out. By default the tolerances.
        pulses: Whether force pulses are rated after ISO 18571, which costs their simulation; by
            default they are.
        stage_tolerances: Tolerances (d,), by the name of the stage and in the units of its
            observables, of the figures in tolerances; by default those of the observables.
        progress: Receives the folds that are fitted, their number and what is fitted; by default
            nothing is called.

    Returns:
        The entry by configuration and that of the corner, each with what the folds fitted; an empty
        list where fewer than two configurations have a gap.
    """
    gaps = Gaps.of(stages, scales)
    if len(gaps.rows) < 2:
        return []
    at_corner = corner(stages[0].record.configurations, gaps.rows, np.sqrt(gaps.squares()))
    splits = [by_configuration(gaps.rows), *([] if at_corner is None else [at_corner])]
    # Each fold is fitted, and its pulses are rated afterwards, which costs about as much.
    step_count = 2 * sum(len(split.folds) for split in splits)
    step_numbers = itertools.count()

    def fitted(training: Rows) -> FoldFit:
        progress(next(step_numbers), step_count, "held out")
        return fit(training)

    results = [FoldCorrections.of(gaps, split, fitted) for split in splits]
    progress(next(step_numbers), step_count, "how far the gap shrinks")
    tolerance = _by_stage(stages, stage_tolerances or {})
    return [(_entry(stages, held, results[0], rng, pulses, tolerance), held) for held in results]


def _by_stage(stages: Sequence[Stage], sizes: Mapping[str, Floats]) -> Floats:
    """(D,): sizes (d,) by stage, in the units of its observables; tolerances where none is
    given."""
    return np.concatenate(
        [sizes.get(stage.name, tolerances(stage.observables)) for stage in stages]
    )


@dataclass(frozen=True, eq=False)
class FoldCorrections:
    """What each fold of a split fitted; `corrections` (k, C, D): what its effects add to the
    simulation, over the scale of `gaps`."""

    gaps: Gaps
    split: ConfigurationFolds
    folds: tuple[FoldFit, ...]
    corrections: Floats

    @classmethod
    def of(cls, gaps: Gaps, split: ConfigurationFolds, fit: Callable[[Rows], FoldFit]) -> Self:
        """What each fold of a split fits.

        Parameters:
            gaps: The gaps before any correction.
            split: The configurations that are held out in turn.
            fit: A function that chooses and fits effects on training configurations (rows of the
                record).
        """
        folds = tuple(fit(np.setdiff1d(gaps.rows, held)) for held in split.folds)
        return cls(gaps, split, folds, gaps.over_scale(np.array([fold.averaged for fold in folds])))

    @property
    def effects_of_folds(self) -> tuple[tuple[str, ...], ...]:
        """Ids of the likeliest effects of each fold."""
        return tuple(tuple(effect.id for effect in fold.likeliest) for fold in self.folds)

    @property
    def effects(self) -> tuple[str, ...]:
        """What most folds chose."""
        return Counter(self.effects_of_folds).most_common(1)[0][0]

    def unseen(self, tables: Floats) -> Floats:
        """(C, D): each configuration's table by the fold that has not seen it; else 0.

        Parameters:
            tables: A table of each fold (k, C, D).
        """
        whole = np.zeros_like(tables[0])
        for held, table in zip(self.split.folds, tables, strict=True):
            whole[held] = table[held]
        return np.asarray(whole)

    @property
    def correction(self) -> Floats:
        return self.unseen(self.corrections)

    @property
    def corrected(self) -> Floats:
        """The same with the learned discrepancy."""
        return self.unseen(self.gaps.over_scale(np.array([fold.corrected for fold in self.folds])))

    def squares(self, correction: Floats | float = 0.0) -> Floats:
        """(n,): mean squared gap of each held-out configuration.

        Parameters:
            correction: What effects add to the simulation, over the scale of `gaps`: (C, D), or one
                number for all cells; by default 0.
        """
        return self.gaps.squares(correction)[self.split.held_out]

    @property
    def floor(self) -> Floats:
        """(n,): what the scatter alone gives to `squares`."""
        return self.gaps.floor[self.split.held_out]

    @property
    def is_gap(self) -> bool:
        """Whether the gap is two standard errors of the scatter above the scatter's part: else none
        to shrink."""
        chance = self.gaps.chance[self.split.held_out]
        return bool(
            (self.squares() - self.floor).mean() > 2 * np.sqrt((chance**2).sum()) / len(chance)
        )

    def fraction(self, correction: Floats) -> float:
        """The part of the reducible gap that a correction takes away where it is held out.

        Parameters:
            correction: What effects add to the simulation (C, D), over the scale of `gaps`.
        """
        means = (
            squares.mean() for squares in (self.squares(), self.squares(correction), self.floor)
        )
        return float(fraction(*means))


def _entry(
    stages: Sequence[Stage],
    held: FoldCorrections,
    folds: FoldCorrections,
    rng: np.random.Generator,
    pulses: bool,
    tolerance: Floats,
) -> Shrinkage:
    correction, rows = held.correction, held.split.held_out
    squares = [held.squares(table) for table in (0.0, correction, held.corrected)]
    before, after, corrected = (float(np.sqrt(square.mean())) for square in squares)
    interval = None
    if held.is_gap:
        spread = _training_spread(held, folds)
        interval = fraction_interval(
            squares[0], squares[1], held.floor, rng, held.gaps.floor_error, spread
        )
    tables = held.gaps.mean[rows], (held.gaps.mean - correction)[rows]
    figures = [_figures(held.gaps, table, tolerance) for table in tables]
    more = {
        CORRECTED: (before, corrected),
        **{name: (figures[0][name], figures[1][name]) for name in figures[0]},
    }
    ratings = (
        pulse_ratings(stages, held.split.folds, [fold.likeliest for fold in held.folds])
        if pulses
        else None
    )
    if ratings is not None:
        more["ISO 18571 rating of the force"] = ratings
    reduced = held.fraction(correction) if held.is_gap else None
    return Shrinkage(held.effects, held.split.name, before, after, reduced, interval, more)


def _training_spread(held: FoldCorrections, folds: FoldCorrections) -> float:
    """Standard deviation of the fraction by the choice of training configurations: a jackknife over
    the folds.

    Over folds that chose the same effects; a fold that chose another one has its say in the
    fraction itself.
    """
    pairs = zip(folds.effects_of_folds, folds.corrections, strict=True)
    fractions = [held.fraction(table) for effects, table in pairs if effects == held.effects]
    if len(fractions) < 2 or not np.isfinite(fractions).all():
        return 0.0
    return float(np.sqrt((len(fractions) - 1) * np.var(fractions)))


def _figures(gaps: Gaps, table: Floats, tolerance: Floats) -> dict[str, float]:
    """Of mean residuals (n, D) over the scale: the rms of each stage alone in tolerances (D',) of
    all observables; of lines of spectra in dB the median and the 95th percentile of the deviation,
    and the shares within 3 and 6 dB."""
    used = np.isfinite(gaps.scale)
    residuals = table * gaps.scale[used]
    in_tolerances = residuals / tolerance[used]
    stages = np.array([item.stage for item in gaps.observables])
    figures = {}
    for name in dict.fromkeys(stages.tolist()):
        cells = in_tolerances[:, stages == name]
        if np.isfinite(cells).any():
            figures[stage_figure(name)] = float(np.sqrt(np.nanmean(cells**2)))
    lines = np.flatnonzero(
        [item.unit == "dB" and item.frequency_hz is not None for item in gaps.observables]
    )
    levels = np.abs(residuals[:, lines])
    levels = levels[np.isfinite(levels)]
    if levels.size:
        figures["dB, median"] = float(np.median(levels))
        figures["dB, 95th percentile"] = float(np.quantile(levels, 0.95))
        figures |= {
            f"share of lines within {limit} dB": float(np.mean(levels <= limit)) for limit in (3, 6)
        }
    return figures
