"""The error that is left with one set of effects or another, on configurations that the fit has not
seen: the path of the report, every choice among the leading effects, and the other effects one by
one, beside the likeliest ones and without them."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from ..array_types import Floats
from ..training.evaluation.summary import clustered, positive_interval
from .conclusion import Conclusion
from .effect_sets import best_by_effects, fit_missing, mean_prediction
from .gap import GapTable
from .gap_reduction import FoldCorrections
from .inference.posterior import HypothesisPosterior
from .inference.subset_fit import SubsetFit
from .observable_families import family_columns
from .unseen_predictions import UnseenPredictions
from .verdict import OTHERS
from .what_if import ComputedSet, Interval, RunName, RunResiduals, WhatIf

#: Of so many leading effects every choice is computed, of fewer where a plate is simulated, which
#: costs ten times as much; further effects come alone, and beside the likeliest set or without it.
_LEADING, _LEADING_WITH_PLATE = 4, 3
#: Sets at most: their numbers are kept with the diagnosis.
_MOST_SETS = 48
#: Families of up to so many observables are shown one by one, the others by their rms.
_SHOWN_SINGLY = 3
#: Resamples of the intervals, and the digits that are kept of residuals: a screen shows no more.
_RESAMPLES, _DIGITS = 1000, 4


def what_if(
    posterior: HypothesisPosterior,
    conclusion: Conclusion,
    held: FoldCorrections | None,
    predictions: UnseenPredictions | None,
    rng: np.random.Generator,
) -> WhatIf:
    """What is left with each set of effects that is computed.

    Parameters:
        posterior: The sets of effects with their probabilities.
        conclusion: What the report concludes from them.
        held: What was held out by configuration; None where there are too few configurations: then
            no set is computed.
        predictions: What sets predict of configurations that they were not fitted to.
        rng: Random numbers of the intervals.
    """
    gap = posterior.gap
    columns = _columns(gap)
    runs = tuple(RunName(run.configuration, run.run, run.repetition) for run in gap.record.runs)
    nominal = _shown(gap, columns, np.zeros_like(gap.mean))
    scatter = np.sqrt(np.diag(gap.noise.covariance)) * np.broadcast_to(
        gap.noise.relative, gap.mean.shape
    )
    of_run = scatter[gap.record.configuration_of]
    residuals = tuple(
        RunResiduals(
            family=family,
            name=family if len(own) > 1 else gap.observables[own[0]].name,
            stage=gap.observables[own[0]].stage,
            unit="tolerances" if len(own) > 1 else gap.observables[own[0]].unit,
            tolerance=1.0 if len(own) > 1 else float(gap.tolerance[own[0]]),
            observables=len(own),
            before=before,
            scatter=_rounded(
                _rms(of_run[:, own] / gap.tolerance[own]) if len(own) > 1 else of_run[:, own[0]]
            ),
        )
        for (family, own), before in zip(columns, nominal, strict=True)
    )
    if held is None or predictions is None:
        return WhatIf(runs, residuals, ())
    sets = []
    for names, table in _tables(posterior, conclusion, held, predictions):
        squares = held.squares(held.gaps.over_scale(table[None])[0])
        fraction = held.fraction(held.gaps.over_scale(table[None])[0]) if held.is_gap else None
        sets.append(
            ComputedSet(
                effects=names,
                after=float(np.sqrt(squares.mean())),
                ci90=_interval(squares, rng),
                fraction=fraction,
                residuals=_shown(gap, columns, table),
            )
        )
    return WhatIf(runs, residuals, tuple(sets[:_MOST_SETS]), _interval(held.squares(), rng))


def _columns(gap: GapTable) -> list[tuple[str, list[int]]]:
    """What is shown: a family, and its columns of the gap table; one by one where they are few."""
    shown: list[tuple[str, list[int]]] = []
    for family, columns in family_columns(gap).items():
        own = columns.tolist()
        shown += [(family, [i]) for i in own] if len(own) <= _SHOWN_SINGLY else [(family, own)]
    return shown


def _shown(
    gap: GapTable, columns: Sequence[tuple[str, list[int]]], table: Floats
) -> tuple[Floats, ...]:
    """(R,) of each: residuals of the runs less what effects change in their configurations (C,
    D)."""
    remaining = gap.residuals - table[gap.record.configuration_of]
    return tuple(
        _rounded(
            _rms(remaining[:, own] / gap.tolerance[own]) if len(own) > 1 else remaining[:, own[0]]
        )
        for _, own in columns
    )


def _rms(values: Floats) -> Floats:
    """(R,) over the columns that a run has; NaN where it has none."""
    finite = np.isfinite(values)
    count = finite.sum(axis=1)
    squares = np.where(finite, values, 0.0) ** 2
    return np.where(count > 0, np.sqrt(squares.sum(axis=1) / np.maximum(count, 1)), np.nan)


def _rounded(values: Floats) -> Floats:
    with np.errstate(divide="ignore", invalid="ignore"):
        places = _DIGITS - 1 - np.floor(np.log10(np.abs(values)))
    scale = 10.0 ** np.where(np.isfinite(places), np.clip(places, -300, 300), 0.0)
    return np.asarray(np.round(values * scale) / scale)


def _interval(squares: Floats, rng: np.random.Generator) -> Interval | None:
    """The 90 % interval of the root of mean squares (n,), from whole configurations."""
    if len(squares) < 2:
        return None
    low, high = positive_interval(
        clustered(squares[:, None], np.arange(len(squares))), rng, _RESAMPLES
    )
    return float(np.sqrt(low[0])), float(np.sqrt(high[0]))


def _tables(
    posterior: HypothesisPosterior,
    conclusion: Conclusion,
    held: FoldCorrections,
    predictions: UnseenPredictions,
) -> Iterator[tuple[tuple[str, ...], Floats]]:
    """Names of effects, and what they predict (C, D), each set of names once: the path, then the
    sets of single effects."""
    names_of_path = [step.added for step in conclusion.established.path]
    choices = conclusion.established.path_choices
    whole = held.unseen(np.array([fold.averaged for fold in held.folds]))
    single = dict(_single_sets(posterior, conclusion))
    every = [fit for own in choices for fit, _ in own] + list(single.values())
    tables = _by_key(every, predictions)
    effect_sets: set[frozenset[str]] = set()
    for i in range(len(names_of_path)):
        names = tuple(names_of_path[: i + 1])
        effect_sets.add(frozenset(names))
        last = i == len(names_of_path) - 1
        yield names, whole if last or OTHERS in names else mean_prediction(choices[i], tables)
    for names, fit in single.items():
        if frozenset(names) not in effect_sets:
            effect_sets.add(frozenset(names))
            yield names, tables[fit.key]


def _by_key(
    fits: Sequence[SubsetFit], predictions: UnseenPredictions
) -> Mapping[tuple[str, ...], Floats]:
    return dict(zip([fit.key for fit in fits], predictions.tables(fits), strict=True))


def _single_sets(
    posterior: HypothesisPosterior, conclusion: Conclusion
) -> Iterator[tuple[tuple[str, ...], SubsetFit]]:
    """Sets of effects by the share of their members, the largest first, each as it was fitted."""
    by_share = [row.effect for row in conclusion.effects]
    named = [name for own in conclusion.established.sets for name in own.effects]
    best = frozenset(posterior.best.effects)
    ranked = sorted(
        by_share, key=lambda name: (name not in named, name not in best, by_share.index(name))
    )
    has_plate = "plate" in posterior.gap.stages
    leading = ranked[: _LEADING_WITH_PLATE if has_plate else _LEADING]
    choices = [
        frozenset(own)
        for size in range(1, len(leading) + 1)
        for own in itertools.combinations(leading, size)
    ]
    # One effect of each established set, and all of these but one: what a box of the report's path
    # takes away when it is unticked.
    whole = frozenset(own.effects[0] for own in conclusion.established.sets)
    choices += [own for own in (whole, *(whole - {name} for name in whole)) if own]
    fit_missing(posterior, choices)
    wanted = [*choices, best, *(best ^ {name} for name in ranked)]
    wanted += [frozenset({name}) for name in ranked]
    fit_of = best_by_effects(posterior)
    for own in dict.fromkeys(wanted):
        if own and own in fit_of:
            yield tuple(sorted(own, key=ranked.index)), fit_of[own]
