"""Whether the gap moves while a campaign goes on: a target that wears, a gain that warms up."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...array_types import Floats, Rows
from ...schema.known_factors import column_of
from ..gap import means, tolerances
from ..observables.base import Observable
from ..record import Factor, RunConfiguration

PERMUTATIONS = 999
_LEVEL = 0.05
#: A drift over the campaign below this part of the tolerance is not worth a sentence.
_SMALL = 0.5
#: Repetitions are spread over a campaign where this share of the variance of the order lies within
#: configurations.
_SPREAD = 0.1
#: A factor changes with the order where it explains this share of the order's variance.
_EXPLAINED = 0.5
#: With less than this share of the order's variance left nothing tells the factor from the order:
#: chance would.
_NOTHING = 0.1
#: With fewer configurations no permutation is rare.
_FEWEST = 5

_DRIFT = "from the first run to the last"
_REPETITION = "from a setting's first repetition to its last"
_CONFOUNDED = (
    ", and {factors} changed in the same order: order of runs and {factors} cannot be told apart "
    "before some levels are run again"
)


class _Trend(NamedTuple):
    """Of d observables: `slope` (d,) for each step of the order, and `p_value` (d,) of as steep
    ones by chance."""

    slope: Floats
    p_value: Floats


def drift(
    residual: Floats,
    configuration: Rows,
    order: Rows,
    observables: Sequence[Observable],
    rng: np.random.Generator,
    permutations: int = PERMUTATIONS,
    configurations: Sequence[RunConfiguration] = (),
) -> tuple[str, ...]:
    """A sentence for each stage whose residuals (R, d) have a trend over the order of runs; ()
    where there is none.

    Where the runs of a configuration are spread over the campaign, its mean is taken off residual
    and order alike, so that a design that was not randomised makes no trend.

    Where they follow one another, or are not repeated, they tell no drift, but how repetitions
    change a setting. Then the means of the `configurations` are held against the order, and once
    more without each factor that changes with it: a trend that is not there without a factor is the
    order's or the factor's, and is not called a drift.
    """
    compared = np.isfinite(residual).any(axis=1)
    place, of = order[compared].astype(np.float64), configuration[compared]
    if place.size < 2 or not np.ptp(place) > 0:
        return ()
    trend = _trend(residual[compared], place, of, rng, permutations)
    within = _centred(place[:, None], of)
    if (within**2).sum() / ((place - place.mean()) ** 2).sum() >= _SPREAD:
        return _sentences(trend, float(np.ptp(place)), _DRIFT, observables)
    stretches = np.array([np.ptp(place[of == c]) for c in np.unique(of)])
    block = float(np.median(stretches[stretches > 0])) if stretches.any() else 0.0
    sentences = _sentences(trend, block, _REPETITION, observables)
    mean = (
        means(residual, configuration, len(configurations))[0] if configurations else residual[:0]
    )
    rows = np.flatnonzero(np.isfinite(mean).any(axis=1))
    if rows.size < _FEWEST:
        return sentences
    place = means(order[:, None].astype(np.float64), configuration, len(configurations))[0][rows, 0]
    trend = _trend(mean[rows], place, np.zeros(rows.size, dtype=np.intp), rng, permutations)
    if trend.p_value.min() > _LEVEL:
        return sentences
    steepest = mean[rows, int(np.argmin(trend.p_value))]
    factors = " and ".join(
        _confounded(steepest, place, [configurations[int(row)] for row in rows], rng, permutations)
    )
    confounded = _CONFOUNDED.format(factors=factors) if factors else ""
    return sentences + _sentences(trend, float(np.ptp(place)), _DRIFT, observables, confounded)


def _trend(
    residual: Floats, order: Floats, group: Rows, rng: np.random.Generator, permutations: int
) -> _Trend:
    """Over residuals (n, d) and places (n,), less the means of their groups; places are permuted
    within these.

    p is of the steepest of all observables, corrected for that choice; 1 where nothing can be
    permuted.
    """
    deviation, time = _centred(residual, group), _centred(order[:, None], group)[:, 0]
    values = np.nan_to_num(deviation)
    if not np.abs(time[values.any(axis=1)]).max(initial=0.0) > 1e-9 * np.abs(order).max():
        return _Trend(np.zeros(values.shape[1]), np.ones(values.shape[1]))
    unit = values / np.maximum(np.linalg.norm(values, axis=0), 1e-300)
    observed = np.abs(time @ unit)
    steepest = [
        np.abs(time[_permutation_within(group, rng)] @ unit).max() for _ in range(permutations)
    ]
    p_value = (1 + (np.array(steepest)[:, None] >= observed).sum(axis=0)) / (1 + permutations)
    weight = np.maximum((np.isfinite(deviation) * time[:, None] ** 2).sum(axis=0), 1e-300)
    return _Trend(time @ values / weight, p_value)


def _confounded(
    mean: Floats,
    place: Floats,
    configurations: Sequence[RunConfiguration],
    rng: np.random.Generator,
    permutations: int,
) -> list[str]:
    """Columns of the factors that change with the order, and without which means (C,) of one
    observable have no trend over places (C,)."""
    columns = []
    measured = np.isfinite(mean)
    for name in dict.fromkeys(
        name for configuration in configurations for name in configuration.factors
    ):
        base, group = _explained_by(
            [configuration.factors.get(name) for configuration in configurations]
        )
        place_rest = _residual(base, place)
        freedom = len(place) - int(np.linalg.matrix_rank(base))
        unexplained = place_rest @ place_rest / max(freedom, 1) / np.var(place, ddof=1)
        if freedom < 1 or 1 - unexplained < _EXPLAINED:
            continue
        if unexplained < _NOTHING:
            place_rest = np.zeros(len(place))
        mean_rest = np.full((len(mean), 1), np.nan)
        mean_rest[measured, 0] = _residual(base[measured], mean[measured])
        if _trend(mean_rest, place_rest, group, rng, permutations).p_value[0] > _LEVEL:
            columns.append(column_of(name)[0])
    return columns


def _explained_by(values: Sequence[Factor | None]) -> tuple[Floats, Rows]:
    """(C, k): what a factor explains in least squares: a constant with ranks of numbers, or with a
    column for each other level. (C,): the groups in which places may be permuted: all for ranks,
    else equal levels."""
    from scipy.stats import rankdata

    constant = np.ones(len(values))
    if all(isinstance(value, int | float) for value in values):
        return np.column_stack([constant, rankdata(np.array(values, dtype=np.float64))]), np.zeros(
            len(values), dtype=np.intp
        )
    levels, group = np.unique([str(value) for value in values], return_inverse=True)
    return np.column_stack([constant, np.eye(len(levels))[group]]), group


def _residual(base: Floats, values: Floats) -> Floats:
    return np.asarray(values - base @ np.linalg.lstsq(base, values, rcond=None)[0])


def _sentences(
    trend: _Trend,
    span: float,
    stretch: str,
    observables: Sequence[Observable],
    confounded: str = "",
) -> tuple[str, ...]:
    """Of each stage the surest, then largest change that is beyond chance and worth a sentence."""
    change = trend.slope * span
    size = np.abs(change) / tolerances(observables)
    surest: dict[str, str] = {}
    for i in np.lexsort((-size, trend.p_value)):
        item = observables[i]
        if trend.p_value[i] <= _LEVEL and size[i] > _SMALL and item.stage not in surest:
            unit = "" if item.unit == "1" else f" {item.unit}"
            verb = "rises" if change[i] > 0 else "falls"
            surest[item.stage] = (
                f"{item.stage}: measured less simulated {item.name} {verb} by "
                f"{abs(change[i]):.2g}{unit} {stretch} (p = {trend.p_value[i]:.2g}){confounded}"
            )
    return tuple(
        surest[stage]
        for stage in dict.fromkeys(item.stage for item in observables)
        if stage in surest
    )


def _centred(values: Floats, group: Rows) -> Floats:
    """Less the means of their groups."""
    mean, _ = means(values, group, int(group.max()) + 1)
    return np.asarray(values - mean[group])


def _permutation_within(group: Rows, rng: np.random.Generator) -> Rows:
    """A permutation that keeps groups."""
    permutation = np.empty(len(group), dtype=np.intp)
    permutation[np.argsort(group, kind="stable")] = np.lexsort((rng.random(len(group)), group))
    return permutation
