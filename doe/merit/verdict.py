"""Whether a design is good, in a word, with the reasons and what cures each of them."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np

from ...array_types import Floats, Levels
from ..order import time_confounding
from ..space import Space
from .model_terms import (
    ENOUGH_POWER,
    USUAL_EFFECT,
    ModelTerm,
    TermPower,
    interaction_terms,
    main_effect_power,
    main_terms,
    term_correlations,
)
from .quality import Quality, quality
from .space_filling import cell_counts

Word = Literal["good", "usable", "poor"]
Weight = Literal["fault", "caution", "note"]

#: Beyond, a correlation of two effects, or the share of a factor's variance that goes with time, is
#: called confounding.
CONFOUNDED = 0.5
#: Of two main effects: neither can be relied upon.
_HIDDEN = 0.9
#: A level's distance from its share, over the share.
_UNEVEN = 0.25
#: Of the D-efficiency of a balanced orthogonal design.
_LOW_EFFICIENCY = 0.7
#: Variance inflation from which textbooks warn (Montgomery, Peck and Vining, chapter 9).
_INFLATED = 5.0
#: Power below which an effect is missed as often as it is seen.
_LOW_POWER = 0.5
#: Set-ups beyond one for each level, from which a scatter of set-ups is judged.
_FEWEST_REPEATED_SET_UPS = 3
#: Pairs of effects that are named one by one.
_MOST_NAMED = 3


@dataclass(frozen=True)
class Reason:
    """One thing that a verdict rests on: a fault makes a design poor, a caution makes it usable, a
    note neither."""

    weight: Weight
    text: str
    cure: str


@dataclass(frozen=True)
class PlanVerdict:
    """A design in a word and a sentence, the reasons from the heaviest to the lightest."""

    word: Word
    sentence: str
    reasons: tuple[Reason, ...]


@dataclass(frozen=True)
class Judgement:
    """All that is known of a design: its figures, terms, their correlations, power, confounding
    with time, verdict."""

    quality: Quality
    terms: tuple[str, ...]  #: main effects, then interactions of two factors
    mains: int  #: how many of the terms are main effects
    correlations: Floats  #: (terms, terms), as `model_terms.term_correlations`
    power: tuple[TermPower, ...]  #: of the main effects
    effect: float  #: in standard deviations of a run, for which the power is
    time: dict[str, float]  #: axis to its share of variance that goes with time
    verdict: PlanVerdict


#: More terms make a map that nobody reads, and minutes of work.
_MOST_TERMS = 400


def judge(space: Space, treatments: Levels, effect: float = USUAL_EFFECT) -> Judgement:
    """Judge treatments (n, axes) in order of run; `effect` is in standard deviations of a run.

    Interactions are left out of the terms where there would be more than 400. Raises `ValueError`
    where there is no run, for an effect that is not above 0, and for rows that are no treatments of
    the space.
    """
    figures = quality(space, treatments)
    mains = main_terms(space, treatments)
    few = len(mains) * (len(mains) + 1) // 2 <= _MOST_TERMS
    terms = [*mains, *(interaction_terms(mains) if few else [])]
    correlations = term_correlations(terms)
    power = main_effect_power(space, treatments, effect)
    time = time_confounding(space, treatments)
    reasons = sorted(
        [
            *_level_reasons(space, space.checked(treatments)),
            *_pair_reasons(space, space.in_strata(treatments)),
            *_confounding_reasons(terms, correlations),
            *_time_reasons(time),
            *_set_up_reasons(space, space.checked(treatments)),
            *_power_reasons(power, effect, figures.runs),
            *_efficiency_reasons(figures, power),
            *_repeat_reasons(space, figures),
        ],
        key=lambda reason: ("fault", "caution", "note").index(reason.weight),
    )
    return Judgement(
        quality=figures,
        terms=tuple(term.name for term in terms),
        mains=len(mains),
        correlations=correlations,
        power=tuple(power),
        effect=effect,
        time=time,
        verdict=_verdict(reasons, power, effect),
    )


def _verdict(reasons: list[Reason], power: list[TermPower], effect: float) -> PlanVerdict:
    faults, cautions = (
        sum(reason.weight == weight for reason in reasons) for weight in ("fault", "caution")
    )
    if faults:
        return PlanVerdict("poor", f"The plan is poor: {_count(faults, 'fault')}.", tuple(reasons))
    seen = min((term.power for term in power), default=0.0)
    able = (
        f"every main effect of {effect:g} standard deviations of a run is seen with a chance of at "
        f"least {math.floor(100 * seen)} %"
    )
    if cautions:
        return PlanVerdict(
            "usable",
            f"The plan is usable with {_count(cautions, 'caution')}; {able}.",
            tuple(reasons),
        )
    return PlanVerdict(
        "good", f"The plan is good: its levels and pairs are even, and {able}.", tuple(reasons)
    )


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}{'' if number == 1 else 's'}"


def _words(name: str) -> str:
    """A term as a sentence names it: "anvil material and insulator", "tip radius x plate
    material"."""
    return " x ".join(
        part.strip("()").replace("+", " and ") for part in name.replace("_", " ").split("*")
    )


def _level_reasons(space: Space, rows: Levels) -> Iterator[Reason]:
    """What is not tried, and what is tried too seldom."""
    cells, stratified = space.in_strata(rows), space.stratified
    counts = [
        np.bincount(cells[:, index], minlength=axis.size)
        for index, axis in enumerate(stratified.axes)
    ]
    in_use = [int((axis_counts > 0).sum()) for axis_counts in counts]
    two_levels = max(in_use) <= 2 < max(axis.size for axis in stratified.axes)
    if two_levels:
        yield Reason(
            "note",
            "No more than two levels of each factor are used, so that a "
            "curved response cannot be seen.",
            "Add centre points (--centre-points 4), or take a method with three levels or more.",
        )
    for axis, axis_counts in zip(stratified.axes, counts, strict=True):
        share = len(rows) / axis.size
        unused = [label for label, count in zip(axis.labels, axis_counts, strict=True) if not count]
        if unused and not two_levels:
            yield Reason(
                "fault",
                f"{_words(axis.name)} has no run at "
                f"{', '.join(unused)}: nothing will be known there.",
                "Add runs with plan augment, which takes the levels that have too few, or leave "
                "the level out of the factors.",
            )
        elif (
            not two_levels
            and (off := np.abs(axis_counts - share).max()) >= 1
            and off > _UNEVEN * share
        ):
            yield Reason(
                "caution",
                f"The levels of {_words(axis.name)} are uneven: {axis_counts.min()} to "
                f"{axis_counts.max()} runs, where {share:.1f} is the balanced share.",
                "Add runs with plan augment, or make the plan with the "
                "method lhs and its criterion balance.",
            )


def _pair_reasons(space: Space, cells: Levels) -> Iterator[Reason]:
    sizes = [axis.strata for axis in space.axes]
    empty, pairs, examples = 0, 0, []
    for a, b in itertools.combinations(range(len(sizes)), 2):
        counts = cell_counts(cells, sizes, (a, b))
        counts = counts[np.ix_(counts.sum(axis=1) > 0, counts.sum(axis=0) > 0)]
        pairs += counts.size
        if len(cells) / counts.size >= 1 and (missing := int((counts == 0).sum())):
            empty += missing
            examples.append(f"{_words(space.axes[a].name)} with {_words(space.axes[b].name)}")
    if empty:
        yield Reason(
            "caution",
            f"{empty} of {_count(pairs, 'pair')} of levels {'has' if empty == 1 else 'have'} no "
            f"run, though there are runs enough: {_some(examples)}.",
            "Add runs with plan augment, or make the plan with the method "
            "lhs and its criterion balance.",
        )


def _some(texts: list[str]) -> str:
    unnamed = len(texts) - _MOST_NAMED
    return "; ".join(texts[:_MOST_NAMED]) + (f"; and {unnamed} more" if unnamed > 0 else "")


def _confounding_reasons(terms: list[ModelTerm], correlations: Floats) -> Iterator[Reason]:
    hidden: list[str] = []
    close: list[str] = []
    mixed: list[str] = []
    interactions = 0
    order = sorted(
        itertools.combinations(range(len(terms)), 2), key=lambda pair: -correlations[pair]
    )
    for a, b in order:
        correlation = correlations[a, b]
        if correlation <= CONFOUNDED:
            break
        text = f"{_words(terms[a].name)} and {_words(terms[b].name)} ({correlation:.2f})"
        if terms[a].main and terms[b].main:
            (hidden if correlation > _HIDDEN else close).append(text)
        elif terms[a].main:
            mixed.append(text)
        else:
            interactions += 1
    if hidden:
        yield Reason(
            "fault",
            f"Main effects that cannot be told apart, with their correlation: {_some(hidden)}.",
            "Add runs in which the one changes without the other: plan augment, or more runs.",
        )
    if close:
        yield Reason(
            "caution",
            f"Main effects that are confounded by more than {CONFOUNDED}, "
            f"with their correlation: {_some(close)}.",
            "Add runs with plan augment, or make the plan with more runs.",
        )
    if mixed:
        yield Reason(
            "caution",
            "Main effects that are confounded with interactions of two factors by more than "
            f"{CONFOUNDED}, with the correlation: {_some(mixed)}.",
            "Make the plan with more runs; for a two-level design, with --resolution 4 or above.",
        )
    if interactions:
        yield Reason(
            "note",
            f"{_count(interactions, 'pair')} of interactions of two factors "
            f"{'is' if interactions == 1 else 'are'} "
            f"confounded with each other by more than {CONFOUNDED}.",
            "If an interaction matters, make the plan with more runs; for a "
            "two-level design, with --resolution 5.",
        )


def _time_reasons(time: dict[str, float]) -> Iterator[Reason]:
    late = [
        f"{_words(axis)} ({100 * share:.0f} % of its variance goes with time)"
        for axis, share in time.items()
        if share > CONFOUNDED
    ]
    if late:
        yield Reason(
            "caution",
            f"A drift of the bench cannot be told from the effect of {_some(late)}.",
            "Make the plan with --blocks 2, which visits every set-up a "
            "second time in reverse order, or with --order "
            "random, which changes everything at random and costs the most work.",
        )


def _set_up_reasons(space: Space, rows: Levels) -> Iterator[Reason]:
    """Of what is heavy to change and set up so seldom that its mounting cannot be told from its
    effect."""
    seldom = []
    for index, axis in enumerate(space.axes):
        levels = len(np.unique(rows[:, index]))
        set_ups = 1 + int((np.diff(rows[:, index]) != 0).sum())
        if axis.change > 0 and levels > 1 and set_ups - levels < _FEWEST_REPEATED_SET_UPS:
            seldom.append(f"{_words(axis.name)} ({set_ups} for {levels} levels)")
    if seldom:
        yield Reason(
            "note",
            "These factors are set up so seldom that the scatter of a set-up cannot be told from "
            f"their effect, and their power does not count it: {_some(seldom)}.",
            "Make the plan with more --blocks, if a set-up does not come "
            "back to the same state each time.",
        )


def _power_reasons(power: list[TermPower], effect: float, runs: int) -> Iterator[Reason]:
    if not power:
        yield Reason(
            "fault",
            f"No factor is varied in {_count(runs, 'run')}, so that nothing can be compared.",
            "Make the plan with more runs.",
        )
        return
    coefficients = 1 + sum(term.columns for term in power)
    if runs <= coefficients:
        yield Reason(
            "fault",
            f"{_count(runs, 'run')} are too few for the {coefficients} coefficients of all main "
            "effects and a measure of their scatter.",
            f"Make the plan with {2 * coefficients} runs or more, or leave out a factor.",
        )
        return
    unseen = [_words(term.term) for term in power if math.isinf(term.variance_inflation)]
    if unseen:
        yield Reason(
            "fault",
            f"These main effects cannot be estimated beside the others: {_some(unseen)}.",
            "Add runs in which the one changes without the other: plan augment, or more runs.",
        )
        return
    weak = [term for term in power if term.power < ENOUGH_POWER]
    if weak:
        names = [f"{_words(term.term)} ({100 * term.power:.0f} %)" for term in weak]
        needed = max(term.runs_needed or 0 for term in weak)
        yield Reason(
            "fault" if min(term.power for term in weak) < _LOW_POWER else "caution",
            f"An effect of {effect:g} standard deviations of a run is seen with a chance below "
            f"{100 * ENOUGH_POWER:.0f} %: {_some(names)}.",
            f"Make the plan with about {needed} runs. Repetitions of a run help only as far as "
            "they make its mean more certain.",
        )


def _efficiency_reasons(figures: Quality, power: list[TermPower]) -> Iterator[Reason]:
    inflated = [
        f"{_words(term.term)} ({term.variance_inflation:.1f})"
        for term in power
        if _INFLATED < term.variance_inflation < math.inf
    ]
    if inflated:
        yield Reason(
            "caution",
            f"The other effects inflate the variance of these more than "
            f"{_INFLATED:g} times: {_some(inflated)}.",
            "Add runs with plan augment, or make the plan with more runs.",
        )
    share = figures.d_efficiency / figures.d_efficiency_limit
    if 0 < share < _LOW_EFFICIENCY:
        yield Reason(
            "caution",
            f"The D-efficiency is {100 * share:.0f} % of that of a balanced orthogonal design: the "
            "runs say less of the main effects than they could.",
            "Make the plan with the method optimal, or with lhs and its criterion balance.",
        )


def _repeat_reasons(space: Space, figures: Quality) -> Iterator[Reason]:
    if figures.runs > 1 and figures.distinct == figures.runs:
        yield Reason(
            "note",
            "No treatment is run twice, so that the scatter from one set-up to the next is not "
            "measured; repetitions of a run do not show it.",
            # words have no centre: their levels take turns, and few centre points are alike
            "Add --replicates 2."
            if any(not axis.ordered for axis in space.axes)
            else "Add --centre-points 4.",
        )
