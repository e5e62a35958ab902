"""What a diagnosis says: the records of a report, and their JSON.

What a report draws of a diagnosis beside its numbers: residuals and curves without and with the
effects that it names.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, is_dataclass, replace
from typing import Any, Self

import numpy as np

from ..array_types import Floats
from ..twin.effects import Effect
from .options import UnknownFigures
from .what_if import ErrorMap, WhatIf


@dataclass(frozen=True, eq=False)
class ResidualPicture:
    """One observable over the configurations: measured less simulated, means over runs, NaN where
    there is none.

    `before` (C,) is the nominal simulator's, `after` (C,) with the fitted effects, None without
    them. `floor` (C,) is what repetitions leave of such a mean, one standard deviation. All in
    `unit`.
    """

    name: str
    stage: str
    unit: str
    tolerance: float
    before: Floats
    after: Floats | None
    floor: Floats


@dataclass(frozen=True, eq=False)
class CurvePicture:
    """A record as it was measured, and as it is simulated before and after: a pulse (x in s), a
    spectrum (x in Hz)."""

    title: str
    x_name: str
    x_unit: str
    y_name: str
    y_unit: str
    x: Floats
    measured: Floats
    before: Floats
    after: Floats | None = None
    logarithmic: bool = False


@dataclass(frozen=True)
class Pictures:
    """What is drawn. `configurations` are the labels of the C configurations. `drawn_effects`: ids
    of the effects that `after` is drawn with; of several such sets the mean of their predictions.
    () where nothing is drawn after, and of an older version's pictures, which did not say it."""

    configurations: tuple[str, ...] = ()
    residuals: tuple[ResidualPicture, ...] = ()
    curves: tuple[CurvePicture, ...] = ()
    drawn_effects: tuple[tuple[str, ...], ...] = ()


NONE, UNKNOWN = "none", "unknown"
#: The last step of a path where effects that are not established take something away.
OTHERS = "effects that are not established"
#: Between the effects of a set in the name of a step.
_OR = " or "
#: The entry of `Shrinkage.more` with what goes when the learned discrepancy corrects the rest.
CORRECTED = "with the learned discrepancy"
#: Of `Shrinkage.held_out_by`: each configuration in turn.
BY_CONFIGURATION = "configuration"
#: A smaller part of the gap is shown as none, and is not said to be gone.
LEAST_FRACTION = 0.005
Interval = tuple[float, float]


def stage_figure(stage: str) -> str:
    """The entry of `Shrinkage.more` with the rms error of one stage alone, in its tolerances.

    Parameters:
        stage: The name of the stage.
    """
    return f"rms of {stage} in tolerances"


@dataclass(frozen=True)
class FamilyGap:
    """How large the gap of one family of observables is, in their unit: velocity, spectrum,
    damping.

    `beyond_noise`: whether more than the tolerance is left of it above the noise floor.
    """

    family: str
    before: float
    noise_floor: float
    tolerance: float
    beyond_noise: bool

    @classmethod
    def of(cls, family: str, before: float, noise_floor: float, tolerance: float) -> Self:
        """The gap of a family, with what follows from its three sizes.

        Parameters:
            family: The name of the family of observables.
            before: The rms gap, in the unit of the family.
            noise_floor: What repetitions leave of it, in the same unit.
            tolerance: The tolerance, in the same unit.
        """
        size = cls(family, before, noise_floor, tolerance, beyond_noise=False)
        return replace(size, beyond_noise=size.excess > 1.0)

    @property
    def excess(self) -> float:
        """What is left above the noise floor, in tolerances."""
        return math.sqrt(max(self.before**2 - self.noise_floor**2, 0.0)) / self.tolerance


@dataclass(frozen=True)
class GapSize:
    """How large the gap is; all in the unit that `metric` names. `noise_floor` is what repetitions
    alone leave.

    `families` has the gap of every family of observables, also of those that `metric` does not
    count.
    """

    metric: str
    before: float
    noise_floor: float
    tolerance: float
    beyond_noise: bool
    families: tuple[FamilyGap, ...] = ()


@dataclass(frozen=True)
class StageShare:
    """A stage's part of the gap that the chain shows when it runs freely, at every measured exit
    alike.

    `own` is its gap given its measured input, in tolerances, by the observables that the size of
    the gap counts; `own_ci90` its 90 % interval, None where one configuration says nothing of it.
    """

    name: str
    share: float
    ci90: Interval
    own: float
    own_ci90: Interval | None = None


@dataclass(frozen=True)
class Region:
    """A part of the factor space where the gap exceeds the rest: `excess` in noise floors."""

    rule: str
    excess: float
    p_value: float


@dataclass(frozen=True)
class TimeWindow:
    """Where in time the gap of a channel stands out."""

    channel: str
    from_s: float
    to_s: float


@dataclass(frozen=True)
class FrequencyBand:
    """Where in frequency the gap of a channel stands out."""

    channel: str
    from_hz: float
    to_hz: float


@dataclass(frozen=True)
class Where:
    """Where the gap lies. `drift` are sentences about the order of runs; empty lists where channels
    do not tell."""

    stage: tuple[StageShare, ...] = ()
    factors: tuple[Region, ...] = ()
    time: tuple[TimeWindow, ...] = ()
    frequency: tuple[FrequencyBand, ...] = ()
    drift: tuple[str, ...] = ()

    @property
    def nearly_largest(self) -> tuple[StageShare, ...]:
        """The stages whose own gap is as large as that of the first, as far as the intervals tell:
        that of the difference, from the half of either that faces the other, holds zero. Empty
        where the first is the largest."""
        if not self.stage or self.stage[0].own_ci90 is None:
            return ()
        first, below = self.stage[0], self.stage[0].own - self.stage[0].own_ci90[0]
        return tuple(
            other
            for other in self.stage[1:]
            if other.own_ci90 is not None
            and first.own - other.own <= math.hypot(below, other.own_ci90[1] - other.own)
        )


@dataclass(frozen=True)
class Fitted:
    """One parameter of an effect, with its interval.

    `name` is the catalogue's, with the effect before it in a set
    ("gun.valve_flow.loss_coefficient") and the level that it holds for behind it ("loss_coefficient
    (PLA)").
    """

    name: str
    value: float
    unit: str
    ci90: Interval

    @property
    def parameter(self) -> str:
        """Its name in the catalogue."""
        match = re.match(r"(?:[a-z]+\.[a-z_]+\.)?([A-Za-z]\w*)", self.name)
        return match[1] if match else self.name


@dataclass(frozen=True)
class Cause:
    """One entry of the answer.

    `effects` has several ids where the data cannot tell them apart; "a+b" for two that act
    together; "none" or "unknown" alone. `split` are the shares of a group's members, `parameters`
    those of its likeliest member; `fitted` is that member as effects of the twin, empty for none
    and unknown.
    """

    effects: tuple[str, ...]
    probability: float
    parameters: tuple[Fitted, ...] = ()
    split: tuple[float, ...] = ()
    fitted: tuple[Effect, ...] = ()


@dataclass(frozen=True)
class Shrinkage:
    """How far the gap shrinks on configurations that neither the choice of the cause nor its
    parameters have seen.

    `held_out_by`: "configuration", or "corner: tank_pressure > 2e+05" for the extrapolation. In the
    unit of the gap; `fraction` of the reducible gap, None where there was no gap to shrink. `more`
    are further figures by name, each a pair before and after: `CORRECTED` in the unit of the gap,
    `stage_figure` in tolerances, the others as they are named: dB, shares of lines within 3 and 6
    dB, ISO 18571 scores.
    """

    effects: tuple[str, ...]
    held_out_by: str
    before: float
    after: float
    fraction: float | None
    ci90: Interval | None
    more: Mapping[str, tuple[float, float]] = field(default_factory=dict)


@dataclass(frozen=True)
class EffectShare:
    """What one effect of the catalogue has to do with the gap, averaged over the sets of effects
    that may act.

    `inclusion` is the posterior probability that it acts. `share` of the squared gap is its Shapley
    value, with its 90 % interval. `held_out_gain` is by how much the fraction of the reducible gap
    that disappears on configurations that the fit has not seen is larger with it than without it:
    beside the other effects of the likeliest set, which without it are fitted again and may take a
    part of its place, and in the place of the others of its own set. `credible_set` is the number
    of its set among `Verdict.sets`, from 1; None for an effect of no set. `named`: it is in one.
    """

    effect: str
    inclusion: float
    share: float
    ci90: Interval
    held_out_gain: float
    credible_set: int | None = None
    parameters: tuple[Fitted, ...] = ()
    named: bool = False


@dataclass(frozen=True)
class SettledBy:
    """The channel, not recorded, that would tell the effects of a set apart, and by how much:
    `d_prime` is the least distance between what two of them predict of it, in standard deviations
    of the noise."""

    channel: str
    d_prime: float


def set_name(effects: Sequence[str]) -> str:
    """A set of effects of which at least one acts, as the path has it: "gun.barrel_loss or
    gun.valve_flow".

    Parameters:
        effects: Ids of the effects, the likeliest first.
    """
    return _OR.join(effects)


@dataclass(frozen=True)
class EffectSet:
    """Effects of which at least one acts and which these runs cannot tell apart, the likeliest
    first; one effect that is established by itself is a set of one.

    `inclusion` is the posterior probability that at least one acts, `share` that of all together of
    the squared gap, with its 90 % interval, `held_out_gain` the fraction of the gap that the set
    takes away on configurations that it was not fitted to. `settled_by` is None where no channel is
    known that would tell them apart.
    """

    effects: tuple[str, ...]
    inclusion: float
    share: float
    ci90: Interval
    held_out_gain: float
    settled_by: SettledBy | None = None

    @property
    def name(self) -> str:
        return set_name(self.effects)


@dataclass(frozen=True)
class HeldOutEvidence:
    """What speaks for a set on configurations that the fit has not seen.

    `gain` is the larger of what it adds beside the other likely effects and of what it takes away
    as the path adds it, `gone` the part of the reducible gap that is gone by then, `interval` the
    90 % interval of what the whole fit takes away; None where none is stored.
    """

    gain: float
    gone: float
    interval: Interval | None = None

    @property
    def is_established(self) -> bool:
        """Whether the set may be called a cause."""
        return (
            self.gain >= LEAST_FRACTION
            and self.gone >= LEAST_FRACTION
            and (self.interval is None or self.interval[0] > 0)
        )


@dataclass(frozen=True)
class WeightedEffects:
    """Effects that may stand for the established sets, one of each set, as they were fitted
    together: their `weight` among such choices, and the gap that they leave held out, in the unit
    of `GapSize` (None: not measured)."""

    weight: float
    effects: tuple[Effect, ...]
    after: float | None


@dataclass(frozen=True)
class AveragedEffects:
    """What can be adopted of the established sets, or of the largest of them: `choices` of one
    effect of each set, the likeliest first, whose parameters are values that the parts can have,
    and the gap that the mean of their predictions leaves held out, in the unit of `GapSize` (None:
    not measured)."""

    choices: tuple[WeightedEffects, ...]
    after: float | None


@dataclass(frozen=True)
class Unexplained:
    """The share of the squared gap that no effect takes, with its 90 % interval."""

    share: float
    ci90: Interval


@dataclass(frozen=True)
class PathStep:
    """One step of the path of the shrinkage, largest share first.

    `added` is an effect, or the name of a set of several (`set_name`), or `OTHERS`. `after` is the
    gap that is left, in the unit of `GapSize`, when it acts with all effects before it, measured on
    configurations that the fit has not seen; `fraction` is the part of the reducible gap that is
    gone by then.
    """

    added: str
    after: float
    fraction: float

    @property
    def effects(self) -> tuple[str, ...]:
        """The ids in `added`; () for `OTHERS`."""
        return () if self.added == OTHERS else tuple(self.added.split(_OR))


@dataclass(frozen=True)
class NextRun:
    """A setting that tells causes apart, in the units of its keys, and how many shots of it."""

    why: str
    settings: Mapping[str, str | float]
    runs_needed: int


@dataclass(frozen=True)
class Verdict:
    """A finished diagnosis. `causes` by falling probability, summing to one.

    `effects` has every effect of the catalogue that the campaign's channels can show, by falling
    share; their shares and `unexplained` add up to one. `sets` are those that are established as
    causes, by falling share; `path` adds them in that order, and ends at the fraction of
    `shrinkage`.

    What is not in the JSON: `fits`, every effect ("a+b" for two) as it was fitted by itself, from
    which one can be adopted that is not the likeliest of its group; `averaged`, what can be adopted
    of the established sets, None where no choice of their effects has parameters that the parts can
    have; `unknown_figures`, what the probability of a cause outside of the catalogue follows from,
    None where there is no gap to explain; `set_scores`, the major effects of each likely set with
    its log evidence, the log prior of the set, and the probability that it is within tolerance;
    `pictures`, what the page draws; `what_if`, the error that is left with sets of effects, and
    `error_map`, where it lies by settings: None in verdicts of an older version.
    """

    campaign: str
    simulator: str
    gap: GapSize
    where: Where
    causes: tuple[Cause, ...]
    shrinkage: tuple[Shrinkage, ...] = ()
    effects: tuple[EffectShare, ...] = ()
    unexplained: Unexplained | None = None
    sets: tuple[EffectSet, ...] = ()
    path: tuple[PathStep, ...] = ()
    next_runs: tuple[NextRun, ...] = ()
    assumptions: tuple[str, ...] = ()
    seconds: float = 0.0
    fits: Mapping[str, tuple[Effect, ...]] = field(default_factory=dict)
    averaged: AveragedEffects | None = None
    unknown_figures: UnknownFigures | None = None
    set_scores: tuple[tuple[tuple[str, ...], float, float, float], ...] = ()
    pictures: Pictures = field(default_factory=Pictures)
    what_if: WhatIf | None = None
    error_map: ErrorMap | None = None

    @property
    def first(self) -> Cause:
        return self.causes[0]

    @property
    def cause_sets(self) -> tuple[EffectSet, ...]:
        """The sets of effects that are called causes, by falling share: every text and figure takes
        them from here. They are those of `named_sets` without which less of the gap disappears on
        configurations that the fit has not seen."""
        return tuple(own for own in self.named_sets if self.held_out(own).is_established)

    @property
    def held_out_fraction(self) -> float | None:
        """The part of the reducible gap that the path takes away on configurations that the fit has
        not seen; None: not known."""
        if self.path:  # it ends at the figure of the shrinkage
            return self.path[-1].fraction
        entry = self._by_configuration
        return None if entry is None else entry.fraction

    @property
    def held_out_interval(self) -> Interval | None:
        """The 90 % interval of `held_out_fraction`; None where none is stored."""
        entry = self._by_configuration
        return None if entry is None else entry.ci90

    @property
    def _by_configuration(self) -> Shrinkage | None:
        entries = (own for own in self.shrinkage if own.held_out_by == BY_CONFIGURATION)
        return next(entries, None)

    def held_out(self, own: EffectSet) -> HeldOutEvidence:
        """What speaks for a set on configurations that the fit has not seen.

        Parameters:
            own: A set of this verdict.
        """
        gain, whole = own.held_out_gain, self.held_out_fraction
        gone = gain if whole is None else whole
        before = 0.0
        for step in self.path:
            if set(step.effects) == set(own.effects):
                gain, gone = max(gain, step.fraction - before), step.fraction
                break
            before = step.fraction
        return HeldOutEvidence(gain, gone, self.held_out_interval)

    @property
    def named_sets(self) -> tuple[EffectSet, ...]:
        """The sets of effects that the diagnosis names, by falling share.

        Of a verdict without `sets`, as an older version kept it: the named effects, each with the
        others of its credible set, whose shares have no interval together (NaN).
        """
        if self.sets:
            return tuple(sorted(self.sets, key=lambda own: -own.share))
        groups: list[list[EffectShare]] = []
        for row in self.effects:
            if row.named and not any(row in group for group in groups):
                others = [
                    item
                    for item in self.effects
                    if item.credible_set == row.credible_set and item != row
                ]
                groups.append([row, *others] if row.credible_set is not None else [row])
        return tuple(sorted(map(_set_of, groups), key=lambda own: -own.share))

    def as_json(self) -> dict[str, Any]:
        """The report as scripts read it."""
        names = (
            "campaign",
            "simulator",
            "gap",
            "where",
            "causes",
            "shrinkage",
            "effects",
            "unexplained",
            "sets",
        )
        table = {
            name: plain(getattr(self, name))
            for name in (*names, "path", "next_runs", "assumptions", "seconds")
        }
        for effect in table["effects"]:
            del effect["named"]  # scripts read it from `sets`
        for cause in table["causes"]:
            del cause["fitted"]
            if not cause["parameters"]:
                del cause["parameters"]
            if len(cause["split"]) < 2:
                del cause["split"]
        return table


def _set_of(group: Sequence[EffectShare]) -> EffectSet:
    """Of an older verdict: what is known of a group as a whole."""
    share, gain = sum(row.share for row in group), max(row.held_out_gain for row in group)
    interval = group[0].ci90 if len(group) == 1 else (math.nan, math.nan)
    return EffectSet(
        tuple(row.effect for row in group),
        max(row.inclusion for row in group),
        share,
        interval,
        gain,
    )


def plain(value: Any) -> Any:
    """Records and tuples as JSON has them; of arrays NaN, of which pictures are full, as null,
    infinities by name.

    Parameters:
        value: A record, an effect, an array, or mappings, lists and tuples of such.
    """
    if isinstance(value, Effect):
        return value.as_json()
    if isinstance(value, np.ndarray):
        return [
            v if math.isfinite(v) else None if math.isnan(v) else str(v) for v in value.tolist()
        ]
    if is_dataclass(value):
        return {name: plain(item) for name, item in vars(value).items()}
    if isinstance(value, Mapping):
        return {key: plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    return value
