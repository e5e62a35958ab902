"""Whether the gap moves while a campaign goes on: a target that wears, a gain that warms up."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..observables.base import Observable
from ..record import Configuration, Factor
from .means import Floats, Means
from .rules import column_of

Rows = NDArray[np.intp]

PERMUTATIONS = 999
LEVEL = 0.05
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
    "from the first run to the last, and {factors} changed in the same order: order of runs and {factors} cannot be "
    "told apart before some levels are run again"
)


@dataclass(frozen=True, eq=False)
class Trend:
    """Of d observables: `slope` (d,) for each step of the order, and `p_value` (d,) of as steep ones by chance."""

    slope: Floats
    p_value: Floats

    @classmethod
    def of(
        cls, residual: Floats, order: Floats, group: Rows, rng: np.random.Generator, permutations: int
    ) -> Trend | None:
        """Over residuals (n, d) and places (n,), less the means of their groups; places are permuted within these.

        p is of the steepest of all observables, corrected for that choice. None where nothing can be permuted.
        """
        away, time = _centred(residual, group), _centred(order[:, None], group)[:, 0]
        values = np.nan_to_num(away)
        if not np.abs(time[values.any(axis=1)]).max(initial=0.0) > 1e-9 * np.abs(order).max():
            return None
        observed = np.abs(_correlation(values, time))
        top = np.array([np.abs(_correlation(values, time[_within(group, rng)])).max() for _ in range(permutations)])
        return cls(_slope(away, time), (1 + (top[:, None] >= observed).sum(axis=0)) / (1 + permutations))


def drift(
    residual: Floats,
    configuration: Rows,
    order: Rows,
    observables: Sequence[Observable],
    rng: np.random.Generator,
    permutations: int = PERMUTATIONS,
    level: float = LEVEL,
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
    place = order.astype(np.float64)
    if known.sum() < 2 or not np.ptp(place[known]) > 0:
        return ()
    trend = Trend.of(residual[known], place[known], configuration[known], rng, permutations)
    if _spread(place[known], configuration[known]) >= _SPREAD:
        return () if trend is None else _sentences(trend, float(np.ptp(place[known])), _DRIFT, observables, level)
    found: tuple[str, ...] = ()
    if trend is not None:
        found = _sentences(trend, _block(place[known], configuration[known]), _REPETITION, observables, level)
    means = Means.of(residual, configuration, len(configurations)).mean if configurations else residual[:0]
    rows = np.flatnonzero(np.isfinite(means).any(axis=1))
    if rows.size < _FEWEST:
        return found
    at = Means.of(place[:, None], configuration, len(configurations)).mean[rows, 0]
    trend = Trend.of(means[rows], at, np.zeros(rows.size, dtype=np.intp), rng, permutations)
    if trend is None or trend.p_value.min() > level:
        return found
    steepest = int(np.argmin(trend.p_value))
    beside = _confounded(
        means[rows][:, steepest], at, [configurations[int(row)] for row in rows], rng, permutations, level
    )
    what = _CONFOUNDED.format(factors=" and ".join(beside)) if beside else _DRIFT
    return found + _sentences(trend, float(np.ptp(at)), what, observables, level)


def _confounded(
    mean: Floats,
    place: Floats,
    configurations: Sequence[Configuration],
    rng: np.random.Generator,
    permutations: int,
    level: float,
) -> list[str]:
    """Columns of the factors without which means (C,) of one observable have no trend over places (C,)."""
    found = []
    for name in dict.fromkeys(name for each in configurations for name in each.factors):
        left = _without(_levels([each.factors.get(name) for each in configurations]), mean, place)
        if left is not None:
            trend = Trend.of(*left, rng, permutations)
            if trend is None or trend.p_value[0] > level:
                found.append(column_of(name)[0])
    return found


def _levels(values: Sequence[Factor | None]) -> Floats:
    """(C, k): what a factor explains in least squares: ranks of numbers, and one column for each other level."""
    if all(isinstance(value, int | float) for value in values):
        numbers, group = np.unique(np.array(values, dtype=np.float64), return_inverse=True)
        ranks = np.cumsum(np.bincount(group)) - 0.5 * np.bincount(group)
        return ranks[group][:, None] if numbers.size > 1 else np.zeros((len(values), 0))
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
    left = np.full(count, np.nan)
    left[known] = _residual(base[known], mean[known])
    off = _residual(base, place)
    unexplained = (off @ off / freedom) / (np.var(place) * count / (count - 1))
    if 1 - unexplained < _EXPLAINED:
        return None
    if unexplained < _NOTHING:
        off = np.zeros(count)
    _, group = np.unique(levels, axis=0, return_inverse=True)
    return left[:, None], off, (group.reshape(-1) if levels.shape[1] > 1 else np.zeros(count)).astype(np.intp)


def _residual(base: Floats, values: Floats) -> Floats:
    return np.asarray(values - base @ np.linalg.lstsq(base, values, rcond=None)[0])


def _spread(order: Floats, configuration: Rows) -> float:
    """Share of the variance of the order that lies within configurations."""
    inside = _centred(order[:, None], configuration)
    return float((inside**2).sum() / ((order - order.mean()) ** 2).sum())


def _block(order: Floats, configuration: Rows) -> float:
    """The usual stretch of the order that the runs of a configuration take."""
    stretches = [float(np.ptp(order[configuration == c])) for c in np.unique(configuration)]
    return float(np.median([stretch for stretch in stretches if stretch > 0]))


def _sentences(
    trend: Trend, span: float, stretch: str, observables: Sequence[Observable], level: float
) -> tuple[str, ...]:
    change = trend.slope * span
    size = np.abs(change) / np.array([item.tolerance for item in observables])
    found = []
    for stage in dict.fromkeys(item.stage for item in observables):
        rows = [
            i
            for i, item in enumerate(observables)
            if item.stage == stage and trend.p_value[i] <= level and size[i] > _SMALL
        ]
        if rows:
            best = min(rows, key=lambda i: (trend.p_value[i], -size[i]))
            found.append(_sentence(observables[best], change[best], trend.p_value[best], stretch))
    return tuple(found)


def _sentence(item: Observable, change: float, p_value: float, stretch: str) -> str:
    unit = "" if item.unit == "1" else f" {item.unit}"
    verb = "rises" if change > 0 else "falls"
    where, _, more = stretch.partition(", ")
    tail = f", {more}" if more else ""
    return (
        f"{item.stage}: measured less simulated {item.name} {verb} by {abs(change):.2g}{unit} "
        f"{where} (p = {p_value:.2g}){tail}"
    )


def _centred(values: Floats, group: Rows) -> Floats:
    centred = np.array(values, dtype=np.float64)
    for c in np.unique(group):
        rows = group == c
        known = np.isfinite(centred[rows])
        mean = np.where(known, centred[rows], 0.0).sum(axis=0) / np.maximum(known.sum(axis=0), 1)
        centred[rows] -= mean
    return centred


def _within(group: Rows, rng: np.random.Generator) -> Rows:
    """A permutation that keeps groups."""
    shuffled = np.lexsort((rng.random(len(group)), group))
    found = np.empty(len(group), dtype=np.intp)
    found[np.argsort(group, kind="stable")] = shuffled
    return found


def _correlation(values: Floats, time: Floats) -> Floats:
    norm = np.linalg.norm(values, axis=0) * np.linalg.norm(time)
    return np.asarray(time @ values / np.maximum(norm, 1e-300))


def _slope(away: Floats, time: Floats) -> Floats:
    known = np.isfinite(away)
    weight = np.maximum((known * time[:, None] ** 2).sum(axis=0), 1e-300)
    return np.asarray(time @ np.nan_to_num(away) / weight)
