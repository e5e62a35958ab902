"""Which two effects could stand where one or two others do: screened by linearisation, so that few
sets are fitted.

Two pairs of effects may do the same although every set between them, which has one effect of each,
is much worse. Laws are taken to add to each other, and to follow their derivative within a step of
the search.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...array_types import Floats
from .effect_laws import EffectLaw
from .problem import InferenceProblem
from .subset_fit import SubsetFit, covariance_factor, point_of, residual, split_parts, whitened

#: Longest step from where a law's search begins; step of differences in u.
_STEP, _DIFFERENCE = 1.2, 0.05


@dataclass(frozen=True, eq=False)
class ScreenedSet:
    """A set of laws with the u (p,) from which its fit begins. `score` is its log evidence as the
    linearisation has it, with the log prior of its laws; it compares sets of one screening."""

    laws: tuple[EffectLaw, ...]
    u: Floats
    score: float


@dataclass(frozen=True, eq=False)
class _Additions:
    """K additions of one law each, whitened: what each adds (N, K), and its derivative for the
    first of its u (N, K).

    `price` (K,): |u|^2 / 2 less the log prior; `first` (K,): the first of its u.
    """

    starts: tuple[tuple[EffectLaw, Floats], ...]
    change: Floats
    slope: Floats
    price: Floats
    first: Floats


def exchanges_of_two(
    problem: InferenceProblem,
    current: SubsetFit,
    starts: Sequence[tuple[EffectLaw, Floats]],
    most: int,
) -> list[ScreenedSet]:
    """The best sets, at most `most`, in which two effects stand for one of `current`, one for two,
    two for two, or two more beside all of its effects; the best first. `starts`: laws that may come
    in, and where each begins."""
    factors = [
        covariance_factor(block, own, error)
        for block, own, error in zip(
            problem.blocks, current.contributions, current.errors, strict=True
        )
    ]
    additions = _additions(problem, current, starts, factors)
    best_of_laws: dict[tuple[str, ...], ScreenedSet] = {}
    for out in (*_subsets(current, 2), *_subsets(current, 1), ()):
        for screened in _screened(problem, current, out, additions, factors, most):
            key = tuple(sorted(law.key for law in screened.laws))
            if key not in best_of_laws or screened.score > best_of_laws[key].score:
                best_of_laws[key] = screened
    return sorted(best_of_laws.values(), key=lambda each: -each.score)[:most]


def _subsets(current: SubsetFit, size: int) -> list[tuple[int, ...]]:
    return list(itertools.combinations(range(len(current.laws)), size))


def _additions(
    problem: InferenceProblem,
    current: SubsetFit,
    starts: Sequence[tuple[EffectLaw, Floats]],
    factors: Sequence[Floats],
) -> _Additions:
    """Each law beside the current ones; one that is among them by another law, in its place."""
    parts = dict(
        zip(
            (law.id for law in current.laws),
            zip(current.laws, current.parts, strict=True),
            strict=True,
        )
    )
    beside = [tuple(pair for name, pair in parts.items() if name != law.id) for law, _ in starts]
    laws = [(*(own for own, _ in rest), law) for rest, (law, _) in zip(beside, starts, strict=True)]
    u = [
        np.concatenate([*(own for _, own in rest), u])
        for rest, (_, u) in zip(beside, starts, strict=True)
    ]
    moved = [own.copy() for own in u]
    for own, (law, _) in zip(moved, starts, strict=True):
        own[-law.size] += _DIFFERENCE
    count = len(starts)
    points = [*map(point_of, laws, u), *map(point_of, laws, moved), *beside]
    change, slope = [], []
    for root, table in zip(factors, problem.changes(points), strict=True):
        with_law, nearby, without = table[:count], table[count : 2 * count], table[2 * count :]
        change.append(whitened(root, np.nan_to_num(with_law - without).T))
        slope.append(whitened(root, np.nan_to_num(nearby - with_law).T / _DIFFERENCE))
    price = np.array([0.5 * float(u @ u) - law.log_prior for law, u in starts])
    first = np.array([u[0] for _, u in starts])
    return _Additions(tuple(starts), np.concatenate(change), np.concatenate(slope), price, first)


@dataclass(frozen=True, eq=False)
class _Pairs:
    """Of one addition (K,) and of two (K, K): the score, and the steps in the first u of each (K,
    1) and (K, K, 2)."""

    alone: Floats
    alone_step: Floats
    score: Floats
    step: Floats

    @classmethod
    def of(cls, rest: Floats, change: Floats, slope: Floats, additions: _Additions) -> _Pairs:
        """`rest` (M,): the whitened residual without additions; `change` and `slope` (M, K) of the
        additions."""
        # Minus the score is |rest - change - slope d|^2 / 2 + |u + d|^2 / 2 - log prior +
        # log|curvature| / 2.
        whole = 0.5 * float(rest @ rest)
        overlap = change.T @ change
        cost = 0.5 * np.diag(overlap) - change.T @ rest + additions.price
        pull = slope.T @ rest - (slope * change).sum(axis=0) - additions.first
        curvature = 1 + (slope**2).sum(axis=0)
        step = np.clip(pull / curvature, -_STEP, _STEP)
        alone = -(whole + cost) + pull * step - 0.5 * curvature * step**2 - 0.5 * np.log(curvature)
        # Of two, each meets what the other one leaves.
        crossed = slope.T @ change
        pulls = pull[:, None] - crossed
        shared = slope.T @ slope
        determinant = np.maximum(np.outer(curvature, curvature) - shared**2, 1e-9)
        first = (curvature[None, :] * pulls - shared * pulls.T) / determinant
        steps = np.clip(np.stack([first, first.T], axis=2), -_STEP, _STEP)
        gain = (
            pulls * steps[:, :, 0]
            + pulls.T * steps[:, :, 1]
            - shared * steps[:, :, 0] * steps[:, :, 1]
        )
        gain -= 0.5 * (
            curvature[:, None] * steps[:, :, 0] ** 2 + curvature[None, :] * steps[:, :, 1] ** 2
        )
        score = (
            -(whole + cost[:, None] + cost[None, :] + overlap) + gain - 0.5 * np.log(determinant)
        )
        return cls(alone, step[:, None], score, steps)


def _screened(
    problem: InferenceProblem,
    current: SubsetFit,
    out: tuple[int, ...],
    additions: _Additions,
    factors: Sequence[Floats],
    most: int,
) -> list[ScreenedSet]:
    """Without the laws at the places `out`: the best pairs of additions, and for two laws the best
    single ones."""
    kept = [i for i in range(len(current.laws)) if i not in out]
    parts = split_parts(current.laws, np.arange(len(current.u), dtype=np.float64))
    columns = np.concatenate([np.zeros(0), *(parts[i] for i in kept)]).astype(np.intp)
    u = current.u[columns]
    remaining = problem.changes(
        [tuple(pair for i, pair in enumerate(current.point()) if i in kept)]
    )
    white_residuals = np.concatenate(
        [
            whitened(root, residual(block, table[0]))
            for root, block, table in zip(factors, problem.blocks, remaining, strict=True)
        ]
    )
    slopes = np.concatenate(
        [
            whitened(root, own[:, columns])
            for root, own in zip(factors, current.jacobian, strict=True)
        ]
    )
    # The kept laws' parameters go wherever they fit best: what remains lies across their
    # derivatives. Rows below those of the cells are the prior's.
    design = np.vstack([slopes, np.eye(len(columns))])
    basis, triangle = np.linalg.qr(design)

    def across(cells: Floats, prior: Floats) -> Floats:
        whole = np.vstack([cells, prior])
        return np.asarray(whole - basis @ (basis.T @ whole))

    zeros = np.zeros((len(columns), len(additions.starts)))
    free_residuals = across(white_residuals[:, None], -u[:, None])[:, 0]
    change, slope = across(additions.change, zeros), across(additions.slope, zeros)
    pairs = _Pairs.of(free_residuals, change, slope, additions)
    kept_effects = {current.laws[i].id for i in kept}
    old = {current.laws[i].key for i in out}
    names = [law.id for law, _ in additions.starts]
    free = np.array(
        [law.id not in kept_effects and law.key not in old for law, _ in additions.starts],
        dtype=bool,
    )
    log_prior = sum(current.laws[i].log_prior for i in kept) - float(
        np.log(np.abs(np.diag(triangle))).sum()
    )
    places: list[tuple[tuple[int, ...], float, Floats]] = []
    scores = np.where(free[:, None] & free[None, :], pairs.score, -np.inf)
    scores[np.array(names)[:, None] == np.array(names)[None, :]] = -np.inf
    scores[np.tril_indices(len(names))] = -np.inf
    for flat in np.argsort(-scores, axis=None)[:most]:
        k, m = np.unravel_index(int(flat), scores.shape)
        places.append(((int(k), int(m)), float(scores[k, m]), pairs.step[k, m]))
    if len(out) == 2:
        alone = np.where(free, pairs.alone, -np.inf)
        places += [
            ((int(k),), float(alone[k]), pairs.alone_step[k]) for k in np.argsort(-alone)[:most]
        ]
    screened = []
    for chosen, score, step in places:
        if not np.isfinite(score):
            continue
        fitted = (
            white_residuals
            - additions.change[:, chosen].sum(axis=1)
            - additions.slope[:, chosen] @ step
        )
        move = np.linalg.solve(triangle, basis.T @ np.concatenate([fitted, -u]))
        starts = [additions.starts[k] for k in chosen]
        moved = [
            np.concatenate([[own[0] + by], own[1:]])
            for (_, own), by in zip(starts, step, strict=True)
        ]
        laws = (*(current.laws[i] for i in kept), *(law for law, _ in starts))
        screened.append(
            ScreenedSet(
                laws, np.concatenate([u + np.clip(move, -_STEP, _STEP), *moved]), score + log_prior
            )
        )
    return screened
