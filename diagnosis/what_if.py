"""What a page shows of a diagnosis beside its report: the error that is left with sets of effects,
run by run, and where the error lies, by what is compared and by the settings of the runs.

Records alone; `what_if_sets` and `localisation.error_map` make them.
"""

from __future__ import annotations

from dataclasses import dataclass

from ..array_types import Floats

Interval = tuple[float, float]


@dataclass(frozen=True)
class RunName:
    """A run of the campaign: its configuration (a row of the labels), its number and its
    repetition, as the campaign has them."""

    configuration: int
    run: int
    repetition: int


@dataclass(frozen=True, eq=False)
class RunResiduals:
    """One observable of every run, measured less simulated by the nominal model; or the rms over
    the `observables` of a family, in tolerances.

    `before` (R,) and `scatter` (R,), one standard deviation of a run by the repetitions, are in
    `unit`, as the `tolerance` is; NaN where a run has none.
    """

    family: str
    name: str
    stage: str
    unit: str
    tolerance: float
    observables: int
    before: Floats
    scatter: Floats

    @property
    def is_rms(self) -> bool:
        """Whether it is the size of several observables, without a sign."""
        return self.observables > 1


@dataclass(frozen=True, eq=False)
class ComputedSet:
    """The error that is left when effects act, on configurations that the fit has not seen.

    `effects` are names as `PathStep.added` has them: an effect, a set of which the mean is meant,
    the effects that are not established. `after` is in the unit of `GapSize`, with its 90 %
    interval over the configurations (None: too few); `fraction` is the part of the reducible error
    that is gone (None: there is none to reduce). `residuals`: what is left of each of
    `WhatIf.residuals` (R,).
    """

    effects: tuple[str, ...]
    after: float
    ci90: Interval | None
    fraction: float | None
    residuals: tuple[Floats, ...]


@dataclass(frozen=True, eq=False)
class WhatIf:
    """The sets of effects whose error was computed. `runs` (R) are those of the residuals,
    `before_ci90` the 90 % interval of the error of the nominal model."""

    runs: tuple[RunName, ...]
    residuals: tuple[RunResiduals, ...]
    sets: tuple[ComputedSet, ...]
    before_ci90: Interval | None = None

    def find(self, effects: frozenset[str]) -> ComputedSet | None:
        """The set of exactly these names; None where it was not computed."""
        return next((own for own in self.sets if frozenset(own.effects) == effects), None)

    @property
    def names(self) -> tuple[str, ...]:
        """Every name that is in a set, each once."""
        return tuple(dict.fromkeys(name for own in self.sets for name in own.effects))


@dataclass(frozen=True)
class MapRow:
    """What is compared: a family of observables (`kind` "family"), a stretch of time ("time", from
    `low` to `high` in s) or a band of frequency ("frequency", in Hz) of a channel."""

    kind: str
    stage: str
    name: str
    low: float | None = None
    high: float | None = None


@dataclass(frozen=True)
class MapColumn:
    """The runs of a level of a factor: a word, or numbers in SI from `low` to `high`. `factor` is
    "" for all runs."""

    factor: str
    level: str = ""
    low: float | None = None
    high: float | None = None


@dataclass(frozen=True, eq=False)
class ErrorMap:
    """The rms error of the nominal model in tolerances: `values` has (k,) of the columns for each
    row, NaN where nothing was compared."""

    rows: tuple[MapRow, ...]
    columns: tuple[MapColumn, ...]
    values: tuple[Floats, ...]
