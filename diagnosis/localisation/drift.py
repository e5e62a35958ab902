"""Whether the gap moves while a campaign goes on: a target that wears, a gain that warms up."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..gap import means
from ..observables.base import Observable
from ..record import Configuration, Factor
from .means import Floats, Rows
from .rules import column_of

PERMUTATIONS = 999
_LEVEL = 0.05
#: A drift over the campaign below this part of the tolerance is not worth a sentence.
_SMALL = 0.5
#: Repetitions are spread over a campaign where this share of the variance of the order lies within configurations.
_SPREAD = 0.1
#: A factor changes with the order where it explains this share of the order's variance.
_EXPLAINED = 0.5
#: With less than this share of the order's variance left nothing tells the factor from the order: chance would.
_NOTHING = 0.1
#: With fewer configurations no permutation is rare.
_FEWEST = 5

_DRIFT = "from the first run to the last"
_REPETITION = "from a setting's first repetition to its last"
_CONFOUNDED = (
    ", and {factors} changed in the same order: order of runs and {factors} cannot be told apart before some levels "
    "are run again"
)


class _Trend(NamedTuple):
    """Of d observables: `slope` (d,) for each step of the order, and `p_value` (d,) of as steep ones by chance."""

    slope: Floats
    p_value: Floats


def drift(
    residual: Floats,
    configuration: Rows,
    order: Rows,
    observables: Sequence[Observable],
    rng: np.random.Generator,
    permutations: int = PERMUTATIONS,
    configurations: Sequence[Configuration] = (),
) -> tuple[str, ...]:
    """A sentence for each stage whose residuals (R, d) have a trend over the order of runs; () where there is none.

    Where the runs of a configuration are spread over the campaign, its mean is taken off residual and order alike, so
    that a design that was not randomised makes no trend.

    Where they follow one another, or are not repeated, they tell no drift, but how repetitions change a setting. Then
    the means of the `configurations` are held against the order, and once more without each factor that changes with
    it: a trend that is not there without a factor is the order's or the factor's, and is not called a drift.
    """
    known = np.isfinite(residual).any(axis=1)
    place, of = order[known].astype(np.float64), configuration[known]
    if known.sum() < 2 or not np.ptp(place) > 0:
        return ()
    trend = _trend(residual[known], place, of, rng, permutations)
    within = _centred(place[:, None], of)
    if (within**2).sum() / ((place - place.mean()) ** 2).sum() >= _SPREAD:
        return _sentences(trend, float(np.ptp(place)), _DRIFT, "", observables)
    stretches = [float(np.ptp(place[of == c])) for c in np.unique(of)]
    block = float(np.median([stretch for stretch in stretches if stretch > 0])) if any(stretches) else 0.0
    sentences = _sentences(trend, block, _REPETITION, "", observables)
    mean = means(residual, configuration, len(configurations))[0] if configurations else residual[:0]
    rows = np.flatnonzero(np.isfinite(mean).any(axis=1))
    if rows.size < _FEWEST:
        return sentences
    place = means(order[:, None].astype(np.float64), configuration, len(configurations))[0][rows, 0]
    trend = _trend(mean[rows], place, np.zeros(rows.size, dtype=np.intp), rng, permutations)
    if trend is None or trend.p_value.min() > _LEVEL:
        return sentences
    steepest = mean[rows, int(np.argmin(trend.p_value))]
    factors = _confounded(steepest, place, [configurations[int(row)] for row in rows], rng, permutations)
    confounded = _CONFOUNDED.format(factors=" and ".join(factors)) if factors else ""
    return sentences + _sentences(trend, float(np.ptp(place)), _DRIFT, confounded, observables)


def _trend(residual: Floats, order: Floats, group: Rows, rng: np.random.Generator, permutations: int) -> _Trend | None:
    """Over residuals (n, d) and places (n,), less the means of their groups; places are permuted within these.

    p is of the steepest of all observables, corrected for that choice. None where nothing can be permuted.
    """
    deviation, time = _centred(residual, group), _centred(order[:, None], group)[:, 0]
    values = np.nan_to_num(deviation)
    if not np.abs(time[values.any(axis=1)]).max(initial=0.0) > 1e-9 * np.abs(order).max():
        return None
    observed = np.abs(_correlation(values, time))
    steepest = [np.abs(_correlation(values, time[_within(group, rng)])).max() for _ in range(permutations)]
    p_value = (1 + (np.array(steepest)[:, None] >= observed).sum(axis=0)) / (1 + permutations)
    weight = np.maximum((np.isfinite(deviation) * time[:, None] ** 2).sum(axis=0), 1e-300)
    return _Trend(time @ values / weight, p_value)


def _confounded(
    mean: Floats,
    place: Floats,
    configurations: Sequence[Configuration],
    rng: np.random.Generator,
    permutations: int,
) -> list[str]:
    """Columns of the factors without which means (C,) of one observable have no trend over places (C,)."""
    columns = []
    for name in dict.fromkeys(name for configuration in configurations for name in configuration.factors):
        levels = _levels([configuration.factors.get(name) for configuration in configurations])
        unexplained = _without(levels, mean, place)
        if unexplained is not None:
            trend = _trend(*unexplained, rng, permutations)
            if trend is None or trend.p_value[0] > _LEVEL:
                columns.append(column_of(name)[0])
    return columns


def _levels(values: Sequence[Factor | None]) -> Floats:
    """(C, k): what a factor explains in least squares: ranks of numbers, and one column for each other level."""
    from scipy.stats import rankdata

    if all(isinstance(value, int | float) for value in values):
        ranks = rankdata(np.array(values, dtype=np.float64))[:, None]
        return ranks if np.ptp(ranks) > 0 else np.zeros((len(values), 0))
    words = [str(value) for value in values]
    return np.array([[word == level for level in dict.fromkeys(words)] for word in words], dtype=np.float64)


def _without(levels: Floats, mean: Floats, place: Floats) -> tuple[Floats, Floats, Rows] | None:
    """Means (C, 1) and places (C,) without what a factor's levels (C, k) explain; None where these leave the order as
    it is. The groups, in which places may be permuted, are those of equal levels, or all for ranks."""
    count = len(mean)
    base = np.concatenate([np.ones((count, 1)), levels], axis=1)
    freedom = count - int(np.linalg.matrix_rank(base))
    if levels.shape[1] == 0 or freedom < 1:
        return None
    known = np.isfinite(mean)
    mean_rest = np.full(count, np.nan)
    mean_rest[known] = _residual(base[known], mean[known])
    place_rest = _residual(base, place)
    unexplained = (place_rest @ place_rest / freedom) / np.var(place, ddof=1)
    if 1 - unexplained < _EXPLAINED:
        return None
    if unexplained < _NOTHING:
        place_rest = np.zeros(count)
    group = np.zeros(count, dtype=np.intp)
    if levels.shape[1] > 1:
        group = np.unique(levels, axis=0, return_inverse=True)[1].reshape(-1)
    return mean_rest[:, None], place_rest, group


def _residual(base: Floats, values: Floats) -> Floats:
    return np.asarray(values - base @ np.linalg.lstsq(base, values, rcond=None)[0])


def _sentences(
    trend: _Trend | None, span: float, stretch: str, confounded: str, observables: Sequence[Observable]
) -> tuple[str, ...]:
    """Of each stage the surest, then largest change that is beyond chance and worth a sentence."""
    if trend is None:
        return ()
    change = trend.slope * span
    size = np.abs(change) / np.array([item.tolerance for item in observables])
    sentences = []
    worthy = [i for i in range(len(observables)) if trend.p_value[i] <= _LEVEL and size[i] > _SMALL]
    for stage in dict.fromkeys(observables[i].stage for i in worthy):
        rows = [i for i in worthy if observables[i].stage == stage]
        best = min(rows, key=lambda i: (trend.p_value[i], -size[i]))
        item = observables[best]
        unit = "" if item.unit == "1" else f" {item.unit}"
        verb = "rises" if change[best] > 0 else "falls"
        sentences.append(
            f"{stage}: measured less simulated {item.name} {verb} by {abs(change[best]):.2g}{unit} {stretch} "
            f"(p = {trend.p_value[best]:.2g}){confounded}"
        )
    return tuple(sentences)


def _centred(values: Floats, group: Rows) -> Floats:
    """Less the means of their groups."""
    mean, _ = means(values, group, int(group.max()) + 1)
    return np.asarray(values - mean[group])


def _within(group: Rows, rng: np.random.Generator) -> Rows:
    """A permutation that keeps groups."""
    permutation = np.empty(len(group), dtype=np.intp)
    permutation[np.argsort(group, kind="stable")] = np.lexsort((rng.random(len(group)), group))
    return permutation


def _correlation(values: Floats, time: Floats) -> Floats:
    norm = np.linalg.norm(values, axis=0) * np.linalg.norm(time)
    return np.asarray(time @ values / np.maximum(norm, 1e-300))
