"""The sets of effects that a report calls causes: what they take away held out, in what order, and
what would tell their members apart.

An effect that these runs cannot tell from another is named together with it. What a set predicts is
the mean of what its effects predict, by their probabilities: no single one of them is established.
"""

from __future__ import annotations

import itertools
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..array_types import Floats
from ..twin.effects import Effect
from .gap_reduction import FoldCorrections
from .inference.credible_sets import credible_sets, inclusion
from .inference.model_search import fit_sets
from .inference.posterior import HypothesisPosterior, common_effects, fitted_effects
from .inference.shares import GapShares
from .inference.subset_fit import SubsetFit
from .observables.base import PossibleObservables, Stage
from .parameter_limits import exceeded_limits
from .unseen_predictions import UnseenPredictions
from .verdict import (
    OTHERS,
    AveragedEffects,
    EffectSet,
    PathStep,
    SettledBy,
    WeightedEffects,
    set_name,
)

#: A set with less of the squared gap than this is no cause.
_LEAST_SHARE = 0.02
#: but for one that acts with this probability, and without which at least so much more of the gap
#: is left held out: it hides what others do.
_CERTAIN, _LEAST_GAIN = 0.9, 0.05
#: From this probability on others of the fit may make up for a set held out, as long as it does no
#: harm there.
_SURE = 0.85
#: Choices of one effect from each set whose predictions are averaged, at most, and the least weight
#: of one.
_MOST_CHOICES, _LEAST_WEIGHT = 4, 0.05
#: What the effects of no set take away is a step of its own from this fraction on.
_LEAST_STEP = 0.005
#: A channel tells two effects apart from this d' on.
_TOLD_APART = 3.0


@dataclass(frozen=True, eq=False)
class EstablishedSets:
    """`sets` by falling share. `gains` by effect of the catalogue: by how much the fraction that
    goes is larger with it on configurations that it was not fitted to, in the place of the others
    of its set. `choices`: one effect of each set, as they were fitted together, with their weights,
    the likeliest first. `possible_choices`: those that `averaged` has, of all sets or of the
    largest of them, with parameters that the parts can have. `path_choices`: by step of the path,
    but for the effects that are not established, the choices whose predictions are averaged."""

    sets: tuple[EffectSet, ...]
    gains: Mapping[str, float]
    path: tuple[PathStep, ...]
    choices: tuple[tuple[SubsetFit, float], ...]
    averaged: AveragedEffects | None
    possible_choices: tuple[tuple[SubsetFit, float], ...] = ()
    path_choices: tuple[tuple[tuple[SubsetFit, float], ...], ...] = ()

    @property
    def drawn(self) -> tuple[tuple[SubsetFit, float], ...]:
        """What a picture shows of the sets: what can be adopted of them, or all choices where
        nothing can."""
        return self.possible_choices or self.choices

    @property
    def effects(self) -> tuple[str, ...]:
        return tuple(name for own in self.sets for name in own.effects)

    def number_of(self, effect: str) -> int | None:
        """The number of an effect's set, from 1; None for an effect of no set."""
        return next((i for i, own in enumerate(self.sets, start=1) if effect in own.effects), None)


def established_sets(
    posterior: HypothesisPosterior,
    shares: GapShares,
    held: FoldCorrections | None,
    judged: FoldCorrections | None,
    stages: Sequence[Stage],
    predictions: UnseenPredictions | None = None,
) -> EstablishedSets:
    """The sets that probably act, make a part of the gap, and predict what they have not seen, or
    are sure and do no harm there. `held` is what was held out by configuration; None where there
    are too few configurations, and then nothing is asked of predictions. `judged`: the same, over
    the families of observables by which sets are judged. `predictions` keeps what sets predict
    where they were not fitted; by default it is of this call alone."""
    if held is not None and predictions is None:
        predictions = UnseenPredictions(posterior, held)
    weighted = [(frozenset(fit.effects), weight) for fit, weight in posterior.weighted]
    groups = credible_sets(weighted)
    gains, of_groups = _held_out_gains(posterior, judged, predictions, groups)
    sets = []
    for group in groups:
        gain, error = of_groups.get(group, (np.inf, 0.0))
        share, interval = shares.of_set(group)
        probability = inclusion(weighted, group)
        predicts = gain > error or (probability >= _SURE and gain > -error)
        hides_others = probability >= _CERTAIN and gain > max(error, _LEAST_GAIN)
        if predicts and (share >= _LEAST_SHARE or hides_others):
            measured_gain = gain if np.isfinite(gain) else 0.0
            own = EffectSet(group, probability, share, interval, measured_gain)
            sets.append(replace(own, settled_by=_settled_by(posterior, group, stages)))
    sets.sort(key=lambda own: -own.share)
    # Without a set that is established, what the likeliest effects would take still says how near
    # they come.
    steps = [own.effects for own in sets] or [(name,) for name in posterior.major(posterior.best)]
    choices = [_choices(posterior, steps[: i + 1]) for i in range(len(steps))]
    tables: dict[tuple[str, ...], Floats] = {}
    if held is not None:
        tables = _over_scale(predictions, held, [fit for own in choices for fit, _ in own])
    path = _path(held, steps, choices, tables) if held is not None and steps else ()
    chosen = tuple(choices[-1]) if sets else ()
    # Where the parts cannot have what all sets together need, the larger sets by themselves may be
    # adopted.
    possible = next(filter(None, map(_possible_choices, reversed(choices))), ()) if sets else ()
    averaged = _averaged(possible, held, tables) if possible else None
    return EstablishedSets(
        tuple(sets), gains, path, chosen, averaged, possible, tuple(map(tuple, choices))
    )


def _held_out_gains(
    posterior: HypothesisPosterior,
    held: FoldCorrections | None,
    predictions: UnseenPredictions | None,
    groups: Sequence[tuple[str, ...]],
) -> tuple[dict[str, float], dict[tuple[str, ...], tuple[float, float]]]:
    """By effect the fraction that it adds held out, and by set the same with its standard error; 0
    without a gap.

    An effect of a set takes the place of the others there: beside them it would add nothing. Others
    are left out of the likeliest set, or added to it.
    """
    if held is None:
        return {}, {}
    if not held.is_gap:
        return dict.fromkeys(posterior.effects, 0.0), dict.fromkeys(groups, (0.0, 0.0))
    best = frozenset(posterior.best.effects)
    rest_of = {group: best - set(group) for group in groups}
    several = [group for group in groups if len(group) > 1]
    wanted = [
        own for group in several for own in (rest_of[group], *(rest_of[group] | {m} for m in group))
    ]
    fit_missing(posterior, wanted)
    fit_of = best_by_effects(posterior)
    flipped = {name: fit_of.get(best ^ {name}) for name in posterior.effects}
    fits = [posterior.best, *(fit for fit in flipped.values() if fit is not None)]
    fits += [fit_of[own] for own in wanted]
    tables = _over_scale(predictions, held, fits)
    squares = {key: held.squares(table) for key, table in tables.items()}

    gains: dict[str, float] = {}
    of_groups: dict[tuple[str, ...], tuple[float, float]] = {}
    for name, other in flipped.items():
        of_groups[(name,)] = (0.0, 0.0)
        if other is not None:
            without, acting = (other, posterior.best) if name in best else (posterior.best, other)
            of_groups[(name,)] = _gain(held, squares[without.key], squares[acting.key])
        gains[name] = of_groups[(name,)][0]
    for group in several:
        rest_fit = fit_of[rest_of[group]]
        members = [fit_of[rest_of[group] | {name}] for name in group]
        joint = posterior.library.temper * np.array(
            [posterior.library.log_joint(fit) for fit in members]
        )
        weights = np.exp(joint - joint.max())
        mean = np.tensordot(weights / weights.sum(), [tables[fit.key] for fit in members], axes=1)
        of_groups[group] = _gain(held, squares[rest_fit.key], held.squares(mean))
        gains |= {
            n: _gain(held, squares[rest_fit.key], squares[f.key])[0]
            for n, f in zip(group, members, strict=True)
        }
    return gains, {group: of_groups[group] for group in groups}


def _gain(held: FoldCorrections, without: Floats, with_effect: Floats) -> tuple[float, float]:
    """Difference of the roots over the room, and its jackknife standard error over
    configurations."""
    before, floor = held.squares(), held.gaps.floor[held.split.held_out]

    def value(rows: NDArray[np.bool_]) -> float:
        room = np.sqrt(before[rows].mean()) - np.sqrt(floor[rows].mean())
        return float(
            (np.sqrt(without[rows].mean()) - np.sqrt(with_effect[rows].mean())) / max(room, 1e-9)
        )

    everything = np.ones(len(before), dtype=bool)
    left_out = np.array(
        [value(everything & (np.arange(len(before)) != i)) for i in range(len(before))]
    )
    count = len(before)
    return value(everything), float(
        np.sqrt((count - 1) / count * np.sum((left_out - left_out.mean()) ** 2))
    )


def _path(
    held: FoldCorrections,
    steps: Sequence[tuple[str, ...]],
    choices: Sequence[Sequence[tuple[SubsetFit, float]]],
    tables: Mapping[tuple[str, ...], Floats],
) -> tuple[PathStep, ...]:
    """Sets added one by one, largest share first, held out, up to what all effects of the fit take:
    the last figure is that of the shrinkage."""
    path = [
        _step(set_name(own), held, mean_prediction(some, tables))
        for own, some in zip(steps, choices, strict=True)
    ]
    whole = _step(OTHERS, held, held.correction)
    if _has_others(held, {name for own in steps for name in own}) and _differ(
        path[-1].fraction, whole.fraction
    ):
        return (*path, whole)
    return (*path[:-1], replace(whole, added=path[-1].added))


def mean_prediction(
    choices: Sequence[tuple[SubsetFit, float]], tables: Mapping[tuple[str, ...], Floats]
) -> Floats:
    """(C, D): the mean prediction of choices whose weights need not sum to one.

    Parameters:
        choices: Sets of effects with their weights.
        tables: What each set predicts (C, D), by the keys of its laws.
    """
    total = sum(weight for _, weight in choices)
    return np.asarray(np.sum([weight / total * tables[fit.key] for fit, weight in choices], axis=0))


def _possible_choices(
    choices: Sequence[tuple[SubsetFit, float]],
) -> tuple[tuple[SubsetFit, float], ...]:
    """Those whose parameters are values that the parts can have, with weights of sum one."""
    possible = [
        (fit, weight) for fit, weight in choices if not exceeded_limits(common_effects(fit))
    ]
    total = sum(weight for _, weight in possible)
    return tuple((fit, weight / total) for fit, weight in possible)


def _averaged(
    choices: Sequence[tuple[SubsetFit, float]],
    held: FoldCorrections | None,
    tables: Mapping[tuple[str, ...], Floats],
) -> AveragedEffects:
    def after(some: Sequence[tuple[SubsetFit, float]]) -> float | None:
        return None if held is None else _root(held, mean_prediction(some, tables))

    rows = [
        WeightedEffects(weight, common_effects(fit), after([(fit, weight)]))
        for fit, weight in choices
    ]
    return AveragedEffects(tuple(rows), after(choices))


def _step(added: str, held: FoldCorrections, correction: Floats) -> PathStep:
    return PathStep(added, _root(held, correction), held.fraction(correction))


def _root(held: FoldCorrections, correction: Floats) -> float:
    """The gap that a correction leaves held out."""
    return float(np.sqrt(held.squares(correction).mean()))


def _has_others(held: FoldCorrections, effects: Collection[str]) -> bool:
    return any(
        name not in effects for fold in held.folds for fit in fold.fits for name in fit.effects
    )


def _differ(a: float, b: float) -> bool:
    return not abs(a - b) < _LEAST_STEP


def _choices(
    posterior: HypothesisPosterior, sets: Sequence[tuple[str, ...]]
) -> list[tuple[SubsetFit, float]]:
    """What the likely sets of effects have of some sets, an effect of each at least, fitted by
    itself; with weights of sum one, the largest first."""
    effects = {name for own in sets for name in own}
    mass: dict[frozenset[str], float] = {}
    for fit, weight in posterior.weighted:
        acting = effects & set(fit.effects)
        if all(not acting.isdisjoint(own) for own in sets):
            mass[frozenset(acting)] = mass.get(frozenset(acting), 0.0) + weight
    first = frozenset(own[0] for own in sets)
    likely = sorted((mass or {first: 1.0}).items(), key=lambda item: -item[1])
    likely_sets = [
        (own, weight)
        for own, weight in likely[:_MOST_CHOICES]
        if weight >= _LEAST_WEIGHT * likely[0][1]
    ]
    fit_missing(posterior, [own for own, _ in likely_sets])
    fit_of, total = best_by_effects(posterior), sum(weight for _, weight in likely_sets)
    return [(fit_of[own], weight / total) for own, weight in likely_sets]


def best_by_effects(posterior: HypothesisPosterior) -> dict[frozenset[str], SubsetFit]:
    """The likeliest fit, over laws, of every set of effects that was fitted."""
    ranked = sorted(posterior.library.fits.values(), key=posterior.library.log_joint)
    return {frozenset(fit.effects): fit for fit in ranked}


def fit_missing(posterior: HypothesisPosterior, sets: Sequence[frozenset[str]]) -> None:
    """Fits the sets of effects that were not fitted yet.

    Parameters:
        posterior: Whose library the sets are added to.
        sets: Sets of ids of effects.
    """
    there = {frozenset(fit.effects) for fit in posterior.library.fits.values()}
    missing = dict.fromkeys(own for own in sets if own not in there)
    fit_sets(posterior.problem, posterior.library, [sorted(own) for own in missing])


def _over_scale(
    predictions: UnseenPredictions | None, held: FoldCorrections, fits: Sequence[SubsetFit]
) -> dict[tuple[str, ...], Floats]:
    """By set (C, D): what it predicts where it was not fitted, over the scale of `held`."""
    if predictions is None or not fits:
        return {}
    tables = held.gaps.over_scale(np.array(predictions.tables(fits)))
    return dict(zip([fit.key for fit in fits], tables, strict=True))


def _settled_by(
    posterior: HypothesisPosterior, group: Sequence[str], stages: Sequence[Stage]
) -> SettledBy | None:
    """Of the channels that were not recorded, the one that tells every two effects of a set apart
    by most."""
    if len(group) < 2 or not any(stage.possible_channels for stage in stages):
        return None
    other_effects = frozenset(posterior.best.effects) - set(group)
    members = [other_effects | {name} for name in group]
    fit_missing(posterior, members)
    fit_of = best_by_effects(posterior)
    sets = [fitted_effects(fit_of[own]) for own in members]
    options = [SettledBy(channel, least_distance(own)) for channel, own in _possible(stages, sets)]
    best = max(options, key=lambda own: own.d_prime)
    return best if best.d_prime >= _TOLD_APART else None


def _possible(
    stages: Sequence[Stage], sets: Sequence[Sequence[Effect]]
) -> Iterator[tuple[str, PossibleObservables]]:
    for stage in stages:
        for channel in stage.possible_channels:
            yield channel, stage.possible_observables(channel, sets)


def least_distance(observables: PossibleObservables) -> float:
    """The least d' between any two of the k sets: the root of the squared difference of their
    predictions, whitened by the noise of one run in each configuration. What one of them does not
    answer says nothing."""
    from scipy.linalg import cholesky, solve_triangular

    lower = cholesky(observables.noise, lower=True)
    white = solve_triangular(lower, np.eye(len(lower)), lower=True)
    differences = (
        first - second for first, second in itertools.combinations(observables.predicted, 2)
    )
    return min(
        float(np.linalg.norm(np.nan_to_num(difference) @ white.T)) for difference in differences
    )


__all__ = [
    "EstablishedSets",
    "best_by_effects",
    "established_sets",
    "fit_missing",
    "least_distance",
    "mean_prediction",
]
