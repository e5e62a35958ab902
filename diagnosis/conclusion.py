"""From the inference and what it predicts held out to the entries of a report."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..array_types import Floats
from .gap_reduction import FoldCorrections, Gaps
from .inference.held_out import set_predictions
from .inference.model_search import fit_sets
from .inference.posterior import HypothesisPosterior, fitted_effects, fitted_parameters
from .inference.shares import GapShares
from .inference.subset_fit import SubsetFit
from .observable_families import MODAL, family_columns, family_gaps
from .options import UnknownMap, first_entry_probability
from .verdict import NONE, UNKNOWN, Cause, EffectShare, PathStep, Unexplained

#: Entries below this probability are not listed; what is listed sums to one.
_LISTED = 1e-3
#: Two sets are one entry where these data leave the less likely one a twentieth of both; an entry has at most so many.
_ALIKE, _MOST_ALIKE = 0.05, 4
#: An effect is named from this probability on that it acts.
_INCLUDED = 0.5
#: A named effect with less of the gap stands in the table of effects alone.
_LEAST_LISTED = 0.05
#: An effect that another one cancels is not named for it.
_LEAST_SHARE = 0.02


@dataclass(frozen=True, eq=False)
class Conclusion:
    """The entries of a report. `fits`: every set that can be adopted, as it was fitted; `first_evidence`: the
    probability of the likeliest entry but "unknown" by evidence alone."""

    causes: tuple[Cause, ...]
    effects: tuple[EffectShare, ...]
    unexplained: Unexplained
    path: tuple[PathStep, ...]
    fits: Mapping[str, SubsetFit]
    first_evidence: float


def conclude(
    posterior: HypothesisPosterior, shares: GapShares, held: FoldCorrections | None, unknown: UnknownMap
) -> Conclusion:
    """`held` is what was held out by configuration; None where there are too few configurations."""
    judged = _by_families(posterior, held)
    gains = _held_out_gains(posterior, judged)
    named = _named(posterior, shares, gains)
    listed = _listed_sets(posterior, [name for name in named if shares.share[name] >= _LEAST_LISTED])
    causes_in_catalogue, p_unknown = _known_causes(posterior, *listed), 0.0
    first_evidence = causes_in_catalogue[0].probability
    if _large(posterior):
        fraction = judged.fraction(judged.correction) if judged is not None and judged.is_gap else None
        remaining_gap = None if held is None else _remaining_gap(posterior, held)
        p_unknown = unknown(posterior.log_odds_unknown, fraction, remaining_gap, posterior.within_probability)
        causes_in_catalogue = _weighed(causes_in_catalogue, fraction)
    causes = _listed(causes_in_catalogue, p_unknown)
    path = _path(posterior, held, named)
    if causes[0].effects == (UNKNOWN,):
        named = ()  # those that are nearest, no causes
    return Conclusion(
        causes=causes,
        effects=_effect_shares(posterior, shares, gains, named),
        unexplained=Unexplained(shares.unexplained, shares.unexplained_interval),
        path=path,
        fits=_fits(posterior, named, listed[1]),
        first_evidence=first_evidence,
    )


def _large(posterior: HypothesisPosterior) -> bool:
    """Whether some family of observables has a gap beyond noise and tolerance to be explained."""
    return any(family.beyond_noise for family in family_gaps(posterior.gap)) or posterior.none_probability < 0.5


def _by_families(posterior: HypothesisPosterior, held: FoldCorrections | None) -> FoldCorrections | None:
    """What was held out, by the size of the gap; where that is within tolerance and some family of observables is not,
    by the families that are not, each counted alike, in tolerances."""
    gap = posterior.gap
    families = {item.family for item in family_gaps(gap) if item.beyond_noise}
    if held is None or not families or posterior.metric.size(gap).beyond_noise:
        return held
    columns = [own for name, own in family_columns(gap).items() if name in families]
    scale = np.full(len(gap.observables), np.inf)
    for own in columns:
        scale[own] = gap.tolerance[own] * np.sqrt(len(own) * len(columns) / sum(map(len, columns)))
    scales = {name: scale[gap.columns(name)] for name in gap.stages}
    gaps = Gaps.of(posterior.problem.simulator.stages, scales)
    tables = np.array([fold.averaged for fold in held.folds])
    return replace(held, gaps=gaps, corrections=gaps.over_scale(tables))


def _remaining_gap(posterior: HypothesisPosterior, held: FoldCorrections) -> float:
    """What sets of effects leave held out beyond the noise floor, in tolerances, of the family of observables of which
    they leave most. Modes do not count: their tolerances are finer than the laws of effects are."""
    gap, table = posterior.gap, held.unseen(np.array([fold.averaged for fold in held.folds]))
    rows = held.split.held_out
    excess = ((gap.mean - table) ** 2 - gap.floor_variance)[rows] / gap.tolerance**2
    counted = [own for name, own in family_columns(gap).items() if name not in MODAL]
    cells = [excess[:, own][np.isfinite(excess[:, own])] for own in counted or family_columns(gap).values()]
    return float(np.sqrt(max([0.0, *(float(own.mean()) for own in cells if own.size)])))


def _held_out_gains(posterior: HypothesisPosterior, held: FoldCorrections | None) -> dict[str, tuple[float, float]]:
    """By effect: by how much the fraction that goes is larger with it on configurations that it was not fitted to, and
    the standard error of that; of effects outside of the best set by adding them to it. 0 where there is no gap."""
    if held is None:
        return {}
    if not held.is_gap:
        return dict.fromkeys(posterior.effects, (0.0, 0.0))
    library, best = posterior.library, posterior.best
    by_effects: dict[frozenset[str], SubsetFit] = {}
    for fit in library.fits.values():
        key = frozenset(fit.effects)
        if key not in by_effects or library.log_joint(fit) > library.log_joint(by_effects[key]):
            by_effects[key] = fit
    neighbours = {effect: by_effects.get(frozenset(best.effects) ^ {effect}) for effect in posterior.effects}
    fits = [fit for fit in neighbours.values() if fit is not None]
    whole, *rest = (held.squares(table) for table in _unseen(posterior, held, [best, *fits]))
    squares = iter(rest)
    gains = {}
    for effect, other in neighbours.items():
        if other is None:
            gains[effect] = (0.0, 0.0)
            continue
        own = next(squares)
        less, more = (own, whole) if effect in best.effects else (whole, own)
        gains[effect] = _gain(held, less, more)
    return gains


def _unseen(posterior: HypothesisPosterior, held: FoldCorrections, fits: Sequence[SubsetFit]) -> list[Floats]:
    """By set (C, D): what it predicts of each configuration, fitted to the folds that do not have it."""
    tables = [set_predictions(posterior.library, fold.training, fits) for fold in held.folds]
    return [held.unseen(held.gaps.over_scale(np.array(own))) for own in zip(*tables, strict=True)]


def _gain(held: FoldCorrections, without: Floats, with_effect: Floats) -> tuple[float, float]:
    """Difference of the roots over the room, and its jackknife standard error over configurations."""
    before, floor = held.squares(), held.gaps.floor[held.split.held_out]

    def value(rows: NDArray[np.bool_]) -> float:
        room = np.sqrt(before[rows].mean()) - np.sqrt(floor[rows].mean())
        return float((np.sqrt(without[rows].mean()) - np.sqrt(with_effect[rows].mean())) / max(room, 1e-9))

    everything = np.ones(len(before), dtype=bool)
    left_out = np.array([value(everything & (np.arange(len(before)) != i)) for i in range(len(before))])
    count = len(before)
    return value(everything), float(np.sqrt((count - 1) / count * np.sum((left_out - left_out.mean()) ** 2)))


def _named(
    posterior: HypothesisPosterior, shares: GapShares, gains: Mapping[str, tuple[float, float]]
) -> tuple[str, ...]:
    """Effects that probably act and that predict what they have not seen, by falling share."""
    kept = []
    for effect in posterior.effects:
        gain, error = gains.get(effect, (np.inf, 0.0))
        if posterior.inclusion(effect) >= _INCLUDED and gain > error and shares.share[effect] >= _LEAST_SHARE:
            kept.append(effect)
    return tuple(sorted(kept, key=lambda name: -shares.share[name]))


def _listed_sets(
    posterior: HypothesisPosterior, named: Sequence[str]
) -> tuple[dict[tuple[str, ...], float], dict[tuple[str, ...], SubsetFit]]:
    """Probabilities, and fits, by the effects that a report lists of a set: its major ones, and of its others those
    that are `named`."""
    probabilities: dict[tuple[str, ...], float] = {}
    fits: dict[tuple[str, ...], SubsetFit] = {}
    for major, p in posterior.set_probabilities().items():
        fit = posterior.representative(major)
        names = (*major, *(name for name in named if name in fit.effects and name not in major))
        same = next((earlier_set for earlier_set in fits if set(earlier_set) == set(names)), names)
        probabilities[same] = probabilities.get(same, 0.0) + p
        fits.setdefault(same, fit)
    return probabilities, fits


def _known_causes(
    posterior: HypothesisPosterior,
    probabilities: Mapping[tuple[str, ...], float],
    sets: Mapping[tuple[str, ...], SubsetFit],
) -> list[Cause]:
    """No effect, and sets of effects, those that the data cannot separate in one entry; by falling probability."""
    entries = [Cause((NONE,), posterior.none_probability)]
    remaining = sorted(probabilities, key=lambda names: -probabilities[names])
    while remaining:
        first = remaining.pop(0)
        group = [first]
        for other in list(remaining):
            both = probabilities[first] + probabilities[other]
            if len(group) < _MOST_ALIKE and probabilities[other] >= _ALIKE * both:
                group.append(other)
                remaining.remove(other)
        entries.append(_cause(sets[first], group, [probabilities[names] for names in group]))
    return sorted(entries, key=lambda entry: -entry.probability)


def _weighed(entries: Sequence[Cause], fraction: float | None) -> list[Cause]:
    """The first entry with the probability that such entries are right by experience, and the others with what it
    leaves, in proportion; but "none" keeps its own where it is not the first: other sets that may act do not make it
    likelier. Where there are next to no others, what it leaves is nobody's."""
    first, *others = entries
    effects = () if first.effects == (NONE,) else tuple(first.effects[0].split("+"))
    p = first_entry_probability(first.probability, effects, fraction)
    none = [entry for entry in others if entry.effects == (NONE,)]
    others = [entry for entry in others if entry.effects != (NONE,)]
    whole, rest = 1 - sum(entry.probability for entry in none), sum(entry.probability for entry in others)
    p = min(p, whole)
    if rest < _LISTED:
        return [replace(first, probability=p), *others, *none]
    second = others[0].probability / rest  # the first stays first
    p = max(p, whole * second / (1 + second))
    scaled = [replace(entry, probability=entry.probability * (whole - p) / rest) for entry in others]
    return [replace(first, probability=p), *scaled, *none]


def _listed(causes: Sequence[Cause], p_unknown: float) -> tuple[Cause, ...]:
    """Entries by falling probability, of sum one; `p_unknown` given that the gap is more than a background.

    What the first entry loses and no other has is unknown, too; but it does not make "unknown" the likeliest.
    """
    entries = [
        entry if entry.effects == (NONE,) else replace(entry, probability=entry.probability * (1 - p_unknown))
        for entry in causes
    ]
    by_map = p_unknown * (1 - sum(entry.probability for entry in causes if entry.effects == (NONE,)))
    p = max(1 - sum(entry.probability for entry in entries), 0.0)
    largest = max(entry.probability for entry in entries)
    entries.append(Cause((UNKNOWN,), by_map if by_map <= largest < p else p))
    kept = [entry for entry in entries if entry.probability >= _LISTED or entry.effects[0] in (NONE, UNKNOWN)]
    total = sum(entry.probability for entry in kept) or 1.0
    scaled = [replace(entry, probability=entry.probability / total) for entry in kept]
    return tuple(sorted(scaled, key=lambda entry: -entry.probability))


def _cause(fit: SubsetFit, group: Sequence[tuple[str, ...]], probabilities: Sequence[float]) -> Cause:
    total = sum(probabilities)
    prefix = len(group[0]) > 1
    parameters = [item for name in group[0] for item in fitted_parameters(fit, name, f"{name}." if prefix else "")]
    return Cause(
        effects=tuple("+".join(names) for names in group),
        probability=total,
        parameters=tuple(parameters),
        split=tuple(p / total for p in probabilities) if len(group) > 1 and total > 0 else (),
        fitted=fitted_effects(fit),
    )


def _effect_shares(
    posterior: HypothesisPosterior, shares: GapShares, gains: Mapping[str, tuple[float, float]], named: Sequence[str]
) -> tuple[EffectShare, ...]:
    sets = posterior.credible_sets()
    number = {name: i for i, names in reversed(list(enumerate(sets, start=1))) for name in names}
    rows = [
        EffectShare(
            effect=name,
            inclusion=posterior.inclusion(name),
            share=shares.share[name],
            ci90=shares.interval[name],
            held_out_gain=gains.get(name, (0.0, 0.0))[0],
            credible_set=number.get(name),
            parameters=posterior.parameters(name),
            named=name in named,
        )
        for name in posterior.effects
    ]
    return tuple(sorted(rows, key=lambda row: -row.share))


def _path(posterior: HypothesisPosterior, held: FoldCorrections | None, named: Sequence[str]) -> tuple[PathStep, ...]:
    """The named effects (else those of the likeliest set) added one by one, largest share first, held out."""
    if held is None:
        return ()
    order = list(named) or list(posterior.major(posterior.best) if posterior.best.laws else ())
    prefixes = [order[: i + 1] for i in range(len(order))]
    fit_sets(posterior.problem, posterior.library, prefixes)
    fits = [_fit_of(posterior, prefix) for prefix in prefixes]
    steps = [
        PathStep(prefix[-1], float(np.sqrt(held.squares(table).mean())), held.fraction(table))
        for prefix, table in zip(prefixes, _unseen(posterior, held, fits) if fits else [], strict=True)
    ]
    return tuple(steps)


def _fit_of(posterior: HypothesisPosterior, effects: Sequence[str]) -> SubsetFit:
    wanted = frozenset(effects)
    fits = [fit for fit in posterior.library.fits.values() if frozenset(fit.effects) == wanted]
    return max(fits, key=posterior.library.log_joint)


def _fits(
    posterior: HypothesisPosterior, named: Sequence[str], sets: Mapping[tuple[str, ...], SubsetFit]
) -> dict[str, SubsetFit]:
    """By name, "a+b" for several: every set of the report, each prefix of the path, and single effects."""
    fits = {"+".join(names): fit for names, fit in sets.items()}
    for i in range(len(named)):
        fits.setdefault("+".join(named[: i + 1]), _fit_of(posterior, named[: i + 1]))
    for fit in posterior.library.fits.values():
        if len(fit.laws) == 1:
            fits.setdefault(fit.effects[0], fit)
    return fits
