"""Which effect takes how much of the gap: Shapley values of the squared gap, with their intervals.

The value of a set of effects is by how much they reduce the squared gap, simulated together. An
effect's share is the mean of what it adds over all orders in which the effects may come (Shapley,
1953), so that the shares of all effects and what remains add up to the whole gap. The share of an
effect that works against the others is negative: it hides a part of the gap.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import factorial

import numpy as np

from ...array_types import Floats
from .model_search import ModelLibrary
from .problem import InferenceProblem
from .subset_fit import DISCREPANCIES, SubsetFit, point_of

#: Sets of up to so many effects are valued in full; of larger ones the smallest contributions come
#: first in all orders.
_EXACT = 6
#: Draws from the posterior of parameters and laws' errors, and how many of them are simulated.
DRAWS, _SIMULATED = 400, 10
#: Standard deviation of a share beyond that of its posterior, because benches have laws of their
#: own and small effects that no set needs. Learned on campaigns of development and calibration
#: (`benchmarks/diagnosis_maps.py`): neither the size of the share, nor the scatter of repetitions,
#: nor what is left held out says more of it there.
SHARE_ERROR = 0.25
#: Sets whose shares are averaged, at most, and the least weight of one. The first so many of them,
#: and with so much weight, have exact shares with the spread of their parameters; the others come
#: from what their effects take alone and after all others, which is simulated already.
_MOST, _LEAST = 30, 0.005
_MOST_EXACT, _LEAST_EXACT = 4, 0.05


@dataclass(frozen=True)
class GapShares:
    """`share` and `interval` (90 %) by effect id, of the squared gap beyond the noise floor, and of
    what remains.

    `draws` (n, m): shares of the m effects from the posterior over sets, in the order of `share`;
    `normals` (n, m): the standard normal numbers of their laws' errors.
    """

    share: Mapping[str, float]
    interval: Mapping[str, tuple[float, float]]
    unexplained: float
    unexplained_interval: tuple[float, float]
    draws: Floats
    normals: Floats

    def of_set(self, effects: Sequence[str]) -> tuple[float, tuple[float, float]]:
        """The share of some effects together, with its 90 % interval. Drawn jointly: what one of
        them gives up to another does not widen it. The set errs as its first effect does.

        Parameters:
            effects: Ids of the effects, at least one.
        """
        columns = [list(self.share).index(name) for name in effects]
        return _with_interval(self.draws[:, columns].sum(axis=1), self.normals[:, columns[0]])


def reducible_square(before: float, floor: float) -> float:
    """Of a squared gap what is beyond the noise floor, of which effects take shares; of one near
    the floor, whose shares would be of next to nothing, a quarter.

    Parameters:
        before: The squared gap, in tolerances squared.
        floor: What repetitions leave of it, in tolerances squared.
    """
    return max(before - floor, before / 4, 1e-9)


def gap_shares(
    library: ModelLibrary, weights: Floats, floor: float, rng: np.random.Generator
) -> GapShares:
    """Shares of the effects, averaged over the likeliest sets.

    Parameters:
        library: The sets that were fitted.
        weights: Weights (D,) of the observables' squares in the gap's metric.
        floor: The sum over all cells, so weighed, of the variance that repetitions leave, in
            tolerances squared.
        rng: Random numbers of the draws from the posterior.
    """
    weighted_sets = library.weights()
    # Of very many sets that are alike none has much weight.
    least_weight = min(_LEAST, _LEAST_EXACT * weighted_sets[0][1])
    weighted = [(fit, weight) for fit, weight in weighted_sets if weight > least_weight][:_MOST]
    effects = library.problem.effects
    draws: list[Floats] = []
    total = sum(weight for _, weight in weighted)
    for place, (fit, weight) in enumerate(weighted):
        count = max(1, round(DRAWS * weight / total))
        exact = place == 0 or (place < _MOST_EXACT and weight > _LEAST_EXACT)
        draws.append(_draws(library.problem, fit, weights, floor, effects, count, rng, exact=exact))
    values = np.concatenate(draws)
    normals = rng.standard_normal(values.shape)
    rows = [_with_interval(values[:, i], normals[:, i]) for i in range(values.shape[1])]
    share = {name: mean for name, (mean, _) in zip(effects, rows, strict=False)}
    interval = {name: ends for name, (_, ends) in zip(effects, rows, strict=False)}
    return GapShares(share, interval, *rows[-1], values[:, :-1], normals[:, :-1])


def _with_interval(draws: Floats, normals: Floats) -> tuple[float, tuple[float, float]]:
    """Mean of draws (n,) of a share, and its 90 % interval, widened by what laws are off by: that
    is not in the posterior of their parameters."""
    mean = draws.mean()
    low, high = np.quantile(draws + SHARE_ERROR * normals, [0.05, 0.95])
    return float(mean), (float(min(low, mean)), float(max(high, mean)))


def _draws(
    problem: InferenceProblem,
    fit: SubsetFit,
    weights: Floats,
    floor: float,
    effects: Sequence[str],
    count: int,
    rng: np.random.Generator,
    *,
    exact: bool,
) -> Floats:
    """(count, effects + 1): shares that sum to one, the last what remains."""
    before = _square(problem, weights, [()])[0]
    room = reducible_square(before, floor)
    table = np.zeros((count, len(effects) + 1))
    if fit.laws:
        parts = (_shapley if exact else _first_and_last)(problem, fit, weights, before) / room
        spread = (
            _relative_spread(problem, fit, weights, parts, rng) if exact else np.zeros(len(parts))
        )
        errors = _law_errors(fit)
        drawn = parts * np.exp(
            np.clip(spread * rng.standard_normal((count, len(parts))), -2, 2)
            + np.clip(errors * rng.standard_normal((count, len(parts))), -2, 2)
        )
        for i, law in enumerate(fit.laws):
            table[:, effects.index(law.id)] = drawn[:, i]
        explained = max(float(parts.sum()), 1.0)
        unexplained = max(1 - float(parts.sum()), 0.0)
        wobble = np.abs(
            unexplained
            + 0.5
            * float(np.sqrt(np.sum((errors * parts) ** 2)))
            * rng.standard_normal(count)
            * unexplained**0.5
        )
        table[:, -1] = wobble
        # By size, not by the sum: that is near zero where effects cancel each other.
        sizes = np.abs(table)
        excess = table.sum(axis=1, keepdims=True) - explained
        return np.asarray(
            (table - excess * sizes / np.maximum(sizes.sum(axis=1, keepdims=True), 1e-9))
            / explained
        )
    table[:, -1] = 1.0
    return table


def _square(problem: InferenceProblem, weights: Floats, points: Sequence[object]) -> Floats:
    """(k,): squared gap that sets leave, summed over the cells by the metric's weights."""
    total = np.zeros(len(points))
    for block, table in zip(problem.blocks, problem.changes(points), strict=True):  # type: ignore[arg-type]
        residuals = np.where(np.isfinite(table), block.z - np.nan_to_num(table), block.z)
        total += residuals**2 @ weights[block.observable]
    return total


def _shapley(problem: InferenceProblem, fit: SubsetFit, weights: Floats, before: float) -> Floats:
    """(m,): by how much each law reduces the squared gap, averaged over orders."""
    count = len(fit.laws)
    pairs = fit.point()
    if count > _EXACT:
        return _first_and_last(problem, fit, weights, before)
    subsets = [
        rows for size in range(count + 1) for rows in itertools.combinations(range(count), size)
    ]
    remaining_squares = _square(
        problem, weights, [tuple(pairs[i] for i in rows) for rows in subsets]
    )
    value = {rows: before - remaining_squares[k] for k, rows in enumerate(subsets)}
    parts = np.zeros(count)
    for rows in subsets:
        for i in set(range(count)) - set(rows):
            weight = factorial(len(rows)) * factorial(count - len(rows) - 1) / factorial(count)
            parts[i] += weight * (value[tuple(sorted((*rows, i)))] - value[rows])
    return parts


def _first_and_last(
    problem: InferenceProblem, fit: SubsetFit, weights: Floats, before: float
) -> Floats:
    """(m,): the mean of what a law reduces alone and after all others, scaled to their sum."""
    alone, last, whole = ends(problem, [fit.point()], weights, before)
    mean = (alone + last) / 2
    return np.asarray(mean[0] * whole[0] / mean[0].sum()) if mean[0].sum() > 0 else mean[0]


def ends(
    problem: InferenceProblem, points: Sequence[tuple[object, ...]], weights: Floats, before: float
) -> tuple[Floats, Floats, Floats]:
    """(k, m) reduction of the squared gap by each law alone, (k, m) by each after all others, (k,)
    by all.

    Parameters:
        problem: The problem that simulates them.
        points: k sets of the same m laws, each law with its numbers u.
        weights: Weights (D,) of the observables' squares in the gap's metric.
        before: The squared gap without effects, so weighed, in tolerances squared.
    """
    count = len(points[0])
    points_to_simulate: list[tuple[object, ...]] = []
    for pairs in points:
        points_to_simulate.append(pairs)
        points_to_simulate += [(pair,) for pair in pairs]
        points_to_simulate += [
            tuple(pair for j, pair in enumerate(pairs) if j != i) for i in range(count)
        ]
    reduction = (before - _square(problem, weights, points_to_simulate)).reshape(
        len(points), 1 + 2 * count
    )
    whole = reduction[:, 0]
    return reduction[:, 1 : 1 + count], whole[:, None] - reduction[:, 1 + count :], whole


def _relative_spread(
    problem: InferenceProblem,
    fit: SubsetFit,
    weights: Floats,
    parts: Floats,
    rng: np.random.Generator,
) -> Floats:
    """(m,): standard deviation of the logarithm of each law's reduction, by the posterior of the
    parameters."""
    covariance = np.linalg.inv(fit.precision)
    root = np.linalg.cholesky((covariance + covariance.T) / 2 + 1e-9 * np.eye(len(covariance)))
    before = _square(problem, weights, [()])[0]
    drawn = [fit.u + root @ rng.standard_normal(len(fit.u)) for _ in range(_SIMULATED)]
    points = [fit.point(), *(point_of(fit.laws, u) for u in drawn)]
    alone, last, _ = ends(problem, points, weights, before)
    mean = np.maximum((alone + last) / 2, 1e-3 * np.abs(parts).max() * before + 1e-9)
    return np.asarray(np.minimum(np.std(np.log(mean[1:] / mean[:1]), axis=0), 1.0))


def _law_errors(fit: SubsetFit) -> Floats:
    """(m,): relative errors of the laws, by the discrepancy of the stage in which each contributes
    most."""
    sizes = np.array([np.sqrt((own**2).sum(axis=1)) for own in fit.contributions])
    at = sizes.argmax(axis=0)
    return np.array([DISCREPANCIES[fit.errors[int(index)].discrepancy] for index in at])
