"""From the inference and what it predicts held out to the entries of a report."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from .effect_sets import EstablishedSets, best_by_effects, established_sets
from .gap_reduction import FoldCorrections, Gaps
from .inference.posterior import HypothesisPosterior, fitted_effects, fitted_parameters
from .inference.shares import GapShares
from .inference.subset_fit import SubsetFit
from .observable_families import FINER_THAN_LAWS, family_columns, family_gaps
from .observables.base import Stage
from .options import UnknownFigures, UnknownMap, first_entry_probability, unknown_bound
from .unseen_predictions import UnseenPredictions
from .verdict import NONE, UNKNOWN, Cause, EffectSet, EffectShare, Unexplained

#: Entries below this probability are not listed; what is listed sums to one.
_LISTED = 1e-3
#: What the evidence makes an entry beside the first may grow by so much, and not from next to
#: nothing to a rival.
_MOST_GROWN = 5.0
#: Two sets are one entry where these data leave the less likely one a twentieth of both; an entry
#: has at most so many.
_ALIKE, _MOST_ALIKE = 0.05, 4
#: A set of effects with less of the gap, and without which no more is left held out, stands in the
#: table of effects alone.
_LEAST_LISTED = 0.05


@dataclass(frozen=True, eq=False)
class Conclusion:
    """The entries of a report. `fits`: every set that can be adopted, as it was fitted;
    `established`: the sets that are causes; `unknown_figures`: what the probability of "unknown"
    follows from, None where there is no gap to explain."""

    causes: tuple[Cause, ...]
    effects: tuple[EffectShare, ...]
    unexplained: Unexplained
    established: EstablishedSets
    fits: Mapping[str, SubsetFit]
    unknown_figures: UnknownFigures | None = None


def conclude(
    posterior: HypothesisPosterior,
    shares: GapShares,
    held: FoldCorrections | None,
    unknown: UnknownMap,
    stages: Sequence[Stage] = (),
    predictions: UnseenPredictions | None = None,
) -> Conclusion:
    """The entries of a report.

    Parameters:
        posterior: The sets of effects with their probabilities.
        shares: How much of the gap each effect takes.
        held: What was held out by configuration; None where there are too few configurations.
        unknown: Gives the probability of a cause outside of the catalogue from its figures.
        stages: The stages, which say what channels that were not recorded would show; by default
            none does.
        predictions: Keeps what sets predict where they were not fitted; by default it is of this
            call alone.
    """
    judged = _by_families(posterior, held)
    established = established_sets(posterior, shares, held, judged, stages, predictions)
    large_sets = [
        item for item in established.sets if max(item.share, item.held_out_gain) >= _LEAST_LISTED
    ]
    listed = _listed_sets(posterior, large_sets)
    causes_in_catalogue, p_unknown = _known_causes(posterior, *listed), 0.0
    figures = _unknown_figures(posterior, judged, held) if _large(posterior) else None
    if figures is not None:
        p_unknown = unknown(figures)
        causes_in_catalogue = _weighed(causes_in_catalogue, figures.fraction, p_unknown)
    causes = _listed(causes_in_catalogue, p_unknown, posterior.background_probability)
    if causes[0].effects == (UNKNOWN,):
        # Those that are nearest are no causes.
        established = replace(established, sets=(), choices=(), averaged=None, possible_choices=())
    return Conclusion(
        causes=causes,
        effects=_effect_shares(posterior, shares, established),
        unexplained=Unexplained(shares.unexplained, shares.unexplained_interval),
        established=established,
        fits=_fits(posterior, established, listed[1]),
        unknown_figures=figures,
    )


def _unknown_figures(
    posterior: HypothesisPosterior, judged: FoldCorrections | None, held: FoldCorrections | None
) -> UnknownFigures:
    return UnknownFigures(
        log_odds=posterior.log_odds_unknown,
        fraction=judged.fraction(judged.correction)
        if judged is not None and judged.is_gap
        else None,
        remaining_gap=None if held is None else _remaining_gap(posterior, held),
        none=posterior.within_probability,
        discrepancy=posterior.discrepancy,
        beside=posterior.gain_beside_likeliest,
    )


def _large(posterior: HypothesisPosterior) -> bool:
    """Whether some family of observables has a gap beyond noise and tolerance to be explained."""
    return (
        any(family.beyond_noise for family in family_gaps(posterior.gap))
        or posterior.none_probability < 0.5
    )


def _by_families(
    posterior: HypothesisPosterior, held: FoldCorrections | None
) -> FoldCorrections | None:
    """What was held out, by the size of the gap; where that is within tolerance and some family of
    observables is not, by the families that are not, each counted alike, in tolerances."""
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
    """What sets of effects leave held out beyond the noise floor, in tolerances, of the family of
    observables of which they leave most, but for those whose tolerances are finer than the laws of
    effects are."""
    gap, table = posterior.gap, held.unseen(np.array([fold.averaged for fold in held.folds]))
    rows = held.split.held_out
    excess = ((gap.mean - table) ** 2 - gap.floor_variance)[rows] / gap.tolerance**2
    counted = [own for name, own in family_columns(gap).items() if name not in FINER_THAN_LAWS]
    cells = [
        excess[:, own][np.isfinite(excess[:, own])]
        for own in counted or family_columns(gap).values()
    ]
    return float(np.sqrt(max([0.0, *(float(own.mean()) for own in cells if own.size)])))


def _listed_sets(
    posterior: HypothesisPosterior, sets: Sequence[EffectSet]
) -> tuple[dict[tuple[str, ...], float], dict[tuple[str, ...], SubsetFit]]:
    """Probabilities, and fits, by the effects that a report lists of a set: those of the
    established `sets`, the larger set first; the major ones of a set that has none of them."""
    probabilities: dict[tuple[str, ...], float] = {}
    fits: dict[tuple[str, ...], SubsetFit] = {}
    for major, p in posterior.set_probabilities().items():
        fit = posterior.representative(major)
        acting = {*major, *fit.effects}
        names = tuple(name for own in sets for name in own.effects if name in acting) or major
        same = next((earlier_set for earlier_set in fits if set(earlier_set) == set(names)), names)
        probabilities[same] = probabilities.get(same, 0.0) + p
        fits.setdefault(same, fit)
    return probabilities, fits


def _known_causes(
    posterior: HypothesisPosterior,
    probabilities: Mapping[tuple[str, ...], float],
    sets: Mapping[tuple[str, ...], SubsetFit],
) -> list[Cause]:
    """No effect, and sets of effects, those that the data cannot separate in one entry; by falling
    probability."""
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


def _weighed(
    entries: Sequence[Cause], fraction: float | None, p_unknown: float = 0.0
) -> list[Cause]:
    """The first entry with the probability that such entries are right by experience, and the
    others with what it leaves, in proportion, but no more than `_MOST_GROWN` times their own; but
    "none" keeps its own where it is not the first: other sets that may act do not make it likelier.
    What the first entry leaves and no other takes is nobody's: with `p_unknown`, no more than may
    be unknown."""
    first, *others = entries
    effects = () if first.effects == (NONE,) else tuple(first.effects[0].split("+"))
    p = first_entry_probability(effects, fraction)
    none = [entry for entry in others if entry.effects == (NONE,)]
    others = [entry for entry in others if entry.effects != (NONE,)]
    whole, rest = (
        1 - sum(entry.probability for entry in none),
        sum(entry.probability for entry in others),
    )
    p = min(p, whole)
    if rest >= _LISTED:
        second = others[0].probability / rest  # the first stays first
        p = max(p, whole * second / (1 + second))
    growth = min((whole - p) / rest, _MOST_GROWN) if rest >= _LISTED else 1.0
    least_probability = (
        (1 - unknown_bound(fraction)) / (1 - p_unknown) if effects and p_unknown < 1 else 0.0
    )
    p = max(p, min(whole * min(least_probability, 1.0), whole - growth * rest))
    scaled = [replace(entry, probability=entry.probability * growth) for entry in others]
    return [replace(first, probability=p), *scaled, *none]


def _listed(
    causes: Sequence[Cause], p_unknown: float, background: float = 0.0
) -> tuple[Cause, ...]:
    """Entries by falling probability, of sum one; `p_unknown` given that the gap is more than sets
    within tolerance.

    What the first entry loses and no other has is unknown, too; but it does not make "unknown" the
    likeliest. What no effect explains is a simulator's background with the probability
    `background`: then nothing acts.
    """
    entries = [
        entry
        if entry.effects == (NONE,)
        else replace(entry, probability=entry.probability * (1 - p_unknown))
        for entry in causes
    ]
    by_map = p_unknown * (
        1 - sum(entry.probability for entry in causes if entry.effects == (NONE,))
    )
    p = max(1 - sum(entry.probability for entry in entries), 0.0)
    largest = max(entry.probability for entry in entries)
    unknown = by_map if by_map <= largest < p else p
    entries = [
        replace(entry, probability=entry.probability + background * unknown)
        if entry.effects == (NONE,)
        else entry
        for entry in entries
    ]
    entries.append(Cause((UNKNOWN,), (1 - background) * unknown))
    kept = [
        entry
        for entry in entries
        if entry.probability >= _LISTED or entry.effects[0] in (NONE, UNKNOWN)
    ]
    total = sum(entry.probability for entry in kept) or 1.0
    scaled = [replace(entry, probability=entry.probability / total) for entry in kept]
    return tuple(sorted(scaled, key=lambda entry: -entry.probability))


def _cause(
    fit: SubsetFit, group: Sequence[tuple[str, ...]], probabilities: Sequence[float]
) -> Cause:
    total = sum(probabilities)
    prefix = len(group[0]) > 1
    parameters = [
        item
        for name in group[0]
        for item in fitted_parameters(fit, name, f"{name}." if prefix else "")
    ]
    return Cause(
        effects=tuple("+".join(names) for names in group),
        probability=total,
        parameters=tuple(parameters),
        split=tuple(p / total for p in probabilities) if len(group) > 1 and total > 0 else (),
        fitted=fitted_effects(fit),
    )


def _effect_shares(
    posterior: HypothesisPosterior, shares: GapShares, established: EstablishedSets
) -> tuple[EffectShare, ...]:
    rows = [
        EffectShare(
            effect=name,
            inclusion=posterior.inclusion(name),
            share=shares.share[name],
            ci90=shares.interval[name],
            held_out_gain=established.gains.get(name, 0.0),
            credible_set=established.number_of(name),
            parameters=posterior.parameters(name),
            named=established.number_of(name) is not None,
        )
        for name in posterior.effects
    ]
    return tuple(sorted(rows, key=lambda row: -row.share))


def _fits(
    posterior: HypothesisPosterior,
    established: EstablishedSets,
    sets: Mapping[tuple[str, ...], SubsetFit],
) -> dict[str, SubsetFit]:
    """By name, "a+b" for several: the choices of the established sets, every set of the report, and
    single effects. One that was fitted by itself goes before a larger set that holds it."""
    own = best_by_effects(posterior)
    fits = {"+".join(fit.effects): fit for fit, _ in established.choices}
    fits |= {"+".join(names): own.get(frozenset(names), fit) for names, fit in sets.items()}
    return fits | {fit.effects[0]: fit for fit in own.values() if len(fit.laws) == 1}
