"""What the sets of effects predict on configurations that neither their choice nor their parameters have seen.

Inside of a fold every set of the library is fitted to the training configurations alone, from its derivatives; the
likeliest are then fitted with simulations, weighed by their evidence there, and averaged (Hoeting et al., Stat. Sci. 14
(1999) 382).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...twin.effects import Effect
from .model_search import ModelLibrary
from .problem import InferenceProblem
from .subset_fit import (
    Start,
    SubsetFit,
    covariance,
    factor,
    fit_subsets,
    newton_step,
    residual,
    with_evidence,
)

Floats = NDArray[np.float64]
Rows = NDArray[np.intp]

#: Sets of the library that are weighed inside of a fold lie within so many nats of the best, and are at most so many.
_WINDOW, _MOST = 40.0, 40
#: Of them so many are fitted with simulations.
_SIMULATED = 5
#: Steps of their fits.
_SETTLING = 3


@dataclass(frozen=True, eq=False)
class FoldFit:
    """The sets of the library as one fold weighs them. `fits` on the training configurations, with `weights`;
    `averaged` (C, D): their mean changes of all configurations, in the observables' units; `corrected`: the same with
    what the learned discrepancy adds."""

    training: Rows
    fits: tuple[SubsetFit, ...]
    weights: Floats
    averaged: Floats
    corrected: Floats

    @property
    def likeliest(self) -> tuple[Effect, ...]:
        """The effects of the likeliest set, as fitted."""
        fit = self.fits[int(np.argmax(self.weights))]
        return tuple(law.effect(own) for law, own in zip(fit.laws, fit.parts, strict=True))


def fit_fold(library: ModelLibrary, training: Rows, only: Sequence[SubsetFit] = ()) -> FoldFit:
    """`training`: places of configurations in the gap table. `only`: some sets instead of the whole library."""
    problem = library.problem
    inside = problem.only(training)
    candidates = list(only) or _candidates(library)
    first = [_linear_fit(problem, inside, fit) for fit in candidates]
    joint = np.array([fit.log_evidence + library.log_set_prior(fit) for fit in first])
    picked = [first[i] for i in np.argsort(-joint)[:_SIMULATED]]
    fits = fit_subsets(inside, [_start_again(inside, fit) for fit in picked], iterations=_SETTLING)
    joint = np.array([fit.log_evidence + library.log_set_prior(fit) for fit in fits])
    weights = np.exp(joint - joint.max())
    weights /= weights.sum()
    table = _answered(problem.simulator.changes([fit.point() for fit in fits]))
    kriged = [_with_discrepancy(problem, inside, fit, own) for fit, own in zip(fits, table, strict=True)]
    averaged, corrected = (np.tensordot(weights, each, axes=1) for each in (table, np.array(kriged)))
    return FoldFit(training, tuple(fits), weights, averaged, corrected)


def _answered(tables: Floats) -> Floats:
    """Tables (k, C, D) with an answer in every cell: a shot that stays in the barrel is taken to be as slow as the
    slowest that leaves it, hence the largest change of the same set and observable; 0 where a set has no answer."""
    size = np.where(np.isfinite(tables), np.abs(tables), -1.0)
    extreme = np.take_along_axis(np.nan_to_num(tables), size.argmax(axis=1)[:, None, :], axis=1)
    return np.asarray(np.where(np.isfinite(tables), tables, extreme))


def _candidates(library: ModelLibrary) -> list[SubsetFit]:
    return [fit for fit, _ in library.weights(_WINDOW)][:_MOST]


def _linear_fit(problem: InferenceProblem, inside: InferenceProblem, fit: SubsetFit) -> SubsetFit:
    """A set fitted to the blocks of `inside` by one step from where all configurations put it."""
    fit = _restricted(problem, inside, fit)
    factors = [factor(covariance(block, fit.contributions[i], fit.errors[i])) for i, block in enumerate(inside.blocks)]
    step = newton_step(inside, factors, fit.change, fit.jacobian, fit.u)
    change = tuple(own + slope @ step for own, slope in zip(fit.change, fit.jacobian, strict=True))
    return with_evidence(inside, replace(fit, u=fit.u + step, change=change))


def _restricted(problem: InferenceProblem, inside: InferenceProblem, fit: SubsetFit) -> SubsetFit:
    kept = [
        np.flatnonzero(np.isin(whole.configuration, part.configuration))
        for whole, part in zip(problem.blocks, inside.blocks, strict=True)
    ]
    return replace(
        fit,
        change=tuple(own[rows] for own, rows in zip(fit.change, kept, strict=True)),
        jacobian=tuple(own[rows] for own, rows in zip(fit.jacobian, kept, strict=True)),
        contributions=tuple(own[:, rows] for own, rows in zip(fit.contributions, kept, strict=True)),
    )


def _start_again(inside: InferenceProblem, fit: SubsetFit) -> Start:
    change = tuple(table[0] for table in inside.changes([fit.point()]))
    return Start(fit.laws, fit.u, fit.contributions, fit.errors, change, fit.jacobian)


def _with_discrepancy(problem: InferenceProblem, inside: InferenceProblem, fit: SubsetFit, table: Floats) -> Floats:
    """(C, D): the effects' changes (C, D), and the mean of background and discrepancy given the training residuals."""
    from scipy.linalg import cho_factor, cho_solve

    corrected = table.copy()
    point = fit.point()
    points = [point, *(tuple(pair for j, pair in enumerate(point) if j != i) for i in range(len(point)))]
    changes = problem.changes(points)
    for index, (whole, part) in enumerate(zip(problem.blocks, inside.blocks, strict=True)):
        rows = np.flatnonzero(np.isin(whole.configuration, part.configuration))
        contributions = np.nan_to_num(changes[index][0] - changes[index][1:])
        matrix = covariance(whole, contributions, fit.errors[index])
        noise = whole.covariances[0]
        known = cho_factor(matrix[np.ix_(rows, rows)])
        weights = cho_solve(known, residual(part, np.nan_to_num(changes[index][0][rows])))
        mean = (matrix - noise)[:, rows] @ weights
        corrected[whole.configuration, whole.observable] += mean * whole.tolerance
    return np.asarray(corrected)


def set_predictions(library: ModelLibrary, training: Rows, fits: Sequence[SubsetFit]) -> Floats:
    """(k, C, D): what each set predicts where it was fitted to the training configurations alone."""
    problem = library.problem
    inside = problem.only(training)
    starts = [_start_again(inside, _linear_fit(problem, inside, fit)) for fit in fits if fit.laws]
    fitted = iter(fit_subsets(inside, starts, iterations=_SETTLING))
    points = [next(fitted).point() if fit.laws else () for fit in fits]
    return _answered(problem.simulator.changes(points))
