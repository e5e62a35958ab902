"""What the sets of effects predict on configurations that neither their choice nor their parameters
have seen.

Inside of a fold every set of the library is fitted to the training configurations alone, from its
derivatives. The likeliest, each once more as though its laws were exact, are averaged such that
they predict best each training configuration from all others (stacking: Yao et al., Bayesian Anal.
13 (2018) 917), because no set of laws is quite true of a real bench: the evidence alone would trust
one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...array_types import Floats, Rows
from ...twin.effects import Effect
from ..gap import GapMetric
from .left_out import corner_rows, left_out_residuals
from .model_search import ModelLibrary
from .problem import InferenceProblem
from .subset_fit import (
    Start,
    SubsetFit,
    covariance,
    covariance_factor,
    fit_subsets,
    newton_step,
    residual,
    with_evidence,
)

#: Sets of the library that are weighed inside of a fold lie within so many nats of the best, and
#: are at most so many.
_WINDOW, _MOST = 40.0, 40
#: Of them so many are averaged; those with a larger weight than this are fitted with simulations.
_STACKED, _LEAST_WEIGHT = 12, 0.02
#: Weight of the condition that the weights sum to one, over that of all cells together.
_SUM_TO_ONE = 1e3
#: A weight that differs from the posterior's by one has to predict so many configurations better,
#: by all that the best set leaves of each: a few configurations do not say which of nearly equal
#: sets predicts.
_POSTERIOR_WEIGHT = 10.0
#: Steps of their fits.
_SETTLING = 3


@dataclass(frozen=True, eq=False)
class FoldFit:
    """The sets of the library as one fold averages them. `fits` on the training configurations, the
    likeliest first, with `weights`; `averaged` (C, D): their mean changes of all configurations, in
    the observables' units; `corrected`: the same with what the learned discrepancy adds."""

    training: Rows
    fits: tuple[SubsetFit, ...]
    weights: Floats
    averaged: Floats
    corrected: Floats

    @property
    def likeliest(self) -> tuple[Effect, ...]:
        """The effects of the likeliest set, as fitted."""
        fit = self.fits[0]
        return tuple(law.effect(own) for law, own in zip(fit.laws, fit.parts, strict=True))


def fit_fold(library: ModelLibrary, training: Rows, only: Sequence[SubsetFit] = ()) -> FoldFit:
    """The sets of a library as one fold fits and averages them.

    Parameters:
        library: The sets that were fitted to all configurations.
        training: The places of the training configurations in the gap table.
        only: Sets that are averaged instead of those of the library; by default those of the
            library are.
    """
    problem = library.problem
    inside = problem.only(training)
    candidates = [fit for fit, _ in library.weights(_WINDOW)][:_MOST]
    linear = [(_linear_fit(problem, inside, fit), fit) for fit in only or candidates]
    linear = sorted(linear, key=lambda pair: library.log_joint(pair[0]), reverse=True)[:_STACKED]
    likely_fits = [fit for fit, _ in linear]
    exact_fits = [_linear_fit(problem, inside, _with_exact_laws(fit)) for _, fit in linear]
    log_joint = np.array([library.log_joint(fit) for fit in likely_fits])
    posterior = np.exp(library.temper * (log_joint - log_joint[0]))
    prior_weights = np.concatenate([posterior / posterior.sum(), np.zeros(len(exact_fits))])
    weights = stacking_weights(inside, [*likely_fits, *exact_fits], prior_weights)
    picked = [
        fit
        for fit, weight in zip([*likely_fits, *exact_fits], weights, strict=True)
        if weight > _LEAST_WEIGHT
    ]
    weights = weights[weights > _LEAST_WEIGHT] / weights[weights > _LEAST_WEIGHT].sum()
    fits = fit_subsets(inside, [_start_again(inside, fit) for fit in picked], iterations=_SETTLING)
    changes = problem.simulator.changes([fit.point() for fit in fits])
    table = _answered(changes)
    kriged = [
        _with_discrepancy(problem, inside, fit, own) for fit, own in zip(fits, table, strict=True)
    ]
    by_cell = cell_weights(weights, changes)
    averaged, corrected = ((by_cell * own).sum(axis=0) for own in (table, np.array(kriged)))
    return FoldFit(training, tuple(fits), weights, averaged, corrected)


def _with_exact_laws(fit: SubsetFit) -> SubsetFit:
    """A set as though its laws were exact. Where they are not quite, parameters that follow the
    data predict better than those that leave what does not fit to the laws' errors; the stacking
    says which."""
    return replace(
        fit, errors=tuple(replace(error, discrepancy=0, detail=0) for error in fit.errors)
    )


def cell_weights(weights: Floats, changes: Floats) -> Floats:
    """(k, C, D), sum one over the k sets: weights of those with an answer in a cell; of all where
    none has.

    Parameters:
        weights: The weight (k,) of each set.
        changes: What each set changes (k, C, D); NaN where it has no answer.
    """
    weights = weights[:, None, None]
    with_answer = np.isfinite(changes) * weights
    total = with_answer.sum(axis=0)
    return np.asarray(np.where(total > 0, with_answer / np.where(total > 0, total, 1.0), weights))


def stacking_weights(
    problem: InferenceProblem, fits: Sequence[SubsetFit], prior_weights: Floats
) -> Floats:
    """(k,): weights of sets, none negative, sum one, whose mean predicts best, in the metric of the
    gap, each configuration from all others, and the corner of the factor space from what is outside
    of it.

    Parameters:
        problem: The problem of the configurations that are predicted.
        fits: The k sets as they were fitted to it.
        prior_weights: Weights (k,) that they stay near, as far as `_POSTERIOR_WEIGHT` says.
    """
    from scipy.optimize import nnls

    if len(fits) == 1:
        return np.ones(1)
    metric = GapMetric.of(problem.gap).weights(problem.gap)
    scale = np.concatenate([np.sqrt(metric[block.observable]) for block in problem.blocks])
    residuals = np.column_stack([_predicted_residuals(problem, fit, scale) for fit in fits])
    # Of weights that sum to one the mean residual is the residual of the mean prediction.
    total = _SUM_TO_ONE * max(float(np.abs(residuals).max()), 1e-9) * np.sqrt(len(residuals))
    count = len(np.unique(np.concatenate([block.configuration for block in problem.blocks])))
    nearness = np.sqrt(_POSTERIOR_WEIGHT * float((residuals**2).sum(axis=0).min()) / count)
    conditions = np.vstack([residuals, nearness * np.eye(len(fits)), np.full(len(fits), total)])
    aims = np.concatenate([np.zeros(len(residuals)), nearness * prior_weights, [total]])
    weights, _ = nnls(conditions, aims)
    return np.asarray(weights / weights.sum())


def _predicted_residuals(problem: InferenceProblem, fit: SubsetFit, scale: Floats) -> Floats:
    """Residuals over the scale (N,): of each configuration, fitted to all others; then of those in
    the corner, fitted to those outside of it, where there is a corner."""
    configuration = np.concatenate([block.configuration for block in problem.blocks])
    lone_configurations, corner_configurations = (
        np.unique(configuration)[:, None],
        corner_rows(problem),
    )
    if corner_configurations is None:
        return left_out_residuals(problem, fit, [lone_configurations])[0] * scale
    residuals, corner_residuals = left_out_residuals(
        problem, fit, [lone_configurations, [corner_configurations]]
    )
    in_corner = np.isin(configuration, corner_configurations)
    return np.concatenate([residuals * scale, (corner_residuals * scale)[in_corner]])


def _answered(tables: Floats) -> Floats:
    """Tables (k, C, D) with an answer in every cell: a shot that stays in the barrel is taken to be
    as slow as the slowest that leaves it, hence the largest change of the same set and observable;
    0 where a set has no answer."""
    size = np.where(np.isfinite(tables), np.abs(tables), -1.0)
    extreme = np.take_along_axis(np.nan_to_num(tables), size.argmax(axis=1)[:, None, :], axis=1)
    return np.asarray(np.where(np.isfinite(tables), tables, extreme))


def _linear_fit(problem: InferenceProblem, inside: InferenceProblem, fit: SubsetFit) -> SubsetFit:
    """A set fitted to the blocks of `inside` by one step from where all configurations put it."""
    fit = _restricted(problem, inside, fit)
    factors = [
        covariance_factor(block, fit.contributions[i], fit.errors[i])
        for i, block in enumerate(inside.blocks)
    ]
    step = newton_step(inside, factors, fit.change, fit.jacobian, fit.u)
    change = tuple(own + slope @ step for own, slope in zip(fit.change, fit.jacobian, strict=True))
    return with_evidence(inside, replace(fit, u=fit.u + step, change=change), factors=factors)


def _restricted(problem: InferenceProblem, inside: InferenceProblem, fit: SubsetFit) -> SubsetFit:
    kept = [
        np.flatnonzero(np.isin(whole.configuration, part.configuration))
        for whole, part in zip(problem.blocks, inside.blocks, strict=True)
    ]
    return replace(
        fit,
        change=tuple(own[rows] for own, rows in zip(fit.change, kept, strict=True)),
        jacobian=tuple(own[rows] for own, rows in zip(fit.jacobian, kept, strict=True)),
        contributions=tuple(
            own[:, rows] for own, rows in zip(fit.contributions, kept, strict=True)
        ),
    )


def _start_again(inside: InferenceProblem, fit: SubsetFit) -> Start:
    change = tuple(table[0] for table in inside.changes([fit.point()]))
    return Start(fit.laws, fit.u, fit.contributions, fit.errors, change, fit.jacobian)


def _with_discrepancy(
    problem: InferenceProblem, inside: InferenceProblem, fit: SubsetFit, table: Floats
) -> Floats:
    """(C, D): the effects' changes (C, D), and the mean of background and discrepancy given the
    training residuals."""
    from scipy.linalg import cho_factor, cho_solve

    corrected = table.copy()
    point = fit.point()
    points = [
        point,
        *(tuple(pair for j, pair in enumerate(point) if j != i) for i in range(len(point))),
    ]
    changes = problem.changes(points)
    for index, (whole, part) in enumerate(zip(problem.blocks, inside.blocks, strict=True)):
        rows = np.flatnonzero(np.isin(whole.configuration, part.configuration))
        contributions = np.nan_to_num(changes[index][0] - changes[index][1:])
        matrix = covariance(whole, contributions, fit.errors[index])
        noise = whole.covariances[0]
        factor = cho_factor(matrix[np.ix_(rows, rows)])
        weights = cho_solve(factor, residual(part, np.nan_to_num(changes[index][0][rows])))
        mean = (matrix - noise)[:, rows] @ weights
        corrected[whole.configuration, whole.observable] += mean * whole.tolerance
    return np.asarray(corrected)


def set_predictions(library: ModelLibrary, training: Rows, fits: Sequence[SubsetFit]) -> Floats:
    """(k, C, D): what each set predicts where it was fitted to the training configurations alone.

    Parameters:
        library: The library of the problem.
        training: The places of the training configurations in the gap table.
        fits: The k sets as they were fitted to all configurations.
    """
    problem = library.problem
    inside = problem.only(training)
    starts = [_start_again(inside, _linear_fit(problem, inside, fit)) for fit in fits if fit.laws]
    fitted = iter(fit_subsets(inside, starts, iterations=_SETTLING))
    points = [next(fitted).point() if fit.laws else () for fit in fits]
    return _answered(problem.simulator.changes(points))
