"""What a set of effects predicts of configurations that are left out of its fit, by the fit's own
derivatives."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from ...array_types import Floats, Rows
from ..factor_corner import corner_of_factors
from ..gap import GapMetric
from .problem import InferenceProblem
from .subset_fit import SubsetFit, covariance_factor, residual


def left_out_residuals(
    problem: InferenceProblem, fit: SubsetFit, partitions: Sequence[Iterable[Rows]]
) -> list[Floats]:
    """For each partition of configurations into groups (N,) over all blocks: residual of each group
    of configurations where the parameters are fitted to all others, linear in u; of configurations
    in no group, the residual of the fit. The groups of a partition have no configuration in common.

    With P = S^-1, the information of what remains is J'PJ - (PJ)_c' (P_cc)^-1 (PJ)_c when the cells
    c go.
    """
    residuals = [
        residual(block, own) for block, own in zip(problem.blocks, fit.change, strict=True)
    ]
    if not len(fit.u):
        return [np.concatenate(residuals) for _ in partitions]
    information, slope = np.eye(len(fit.u)), -fit.u
    weights = []
    for index, block in enumerate(problem.blocks):
        answered = np.isfinite(fit.change[index])
        columns = np.column_stack([np.where(answered, residuals[index], 0.0), fit.jacobian[index]])
        inverse = _inverse_root(
            covariance_factor(block, fit.contributions[index], fit.errors[index])
        )
        weighted = inverse.T @ (inverse @ columns)  # P r and P J
        information = information + fit.jacobian[index].T @ weighted[:, 1:]
        slope = slope + weighted[:, 1:].T @ columns[:, 0]
        weights.append((inverse, weighted))
    left_out = []
    for groups in partitions:
        own_residuals = [own.copy() for own in residuals]
        for group in groups:
            less = np.zeros((len(fit.u), 1 + len(fit.u)))
            cells = [
                np.flatnonzero(np.isin(block.configuration, group)) for block in problem.blocks
            ]
            for rows, (inverse, weighted) in zip(cells, weights, strict=True):
                if rows.size:
                    root = inverse[:, rows]
                    less += weighted[rows, 1:].T @ np.linalg.solve(root.T @ root, weighted[rows])
            step = np.linalg.solve(information - less[:, 1:], slope - less[:, 0])
            for rows, own, jacobian in zip(cells, own_residuals, fit.jacobian, strict=True):
                own[rows] -= jacobian[rows] @ step
        left_out.append(np.concatenate(own_residuals))
    return left_out


def _inverse_root(lower: Floats) -> Floats:
    """L^-1 of a lower Cholesky factor L."""
    from scipy.linalg import lapack

    return np.asarray(lapack.dtrtri(lower, lower=1)[0])


def corner_rows(problem: InferenceProblem) -> Rows | None:
    """The configurations, of those of a problem, in the corner of the factor space where an
    extrapolation has the most to lose; None where there is no corner."""
    gap = problem.gap
    rows = np.unique(np.concatenate([block.configuration for block in problem.blocks]))
    weight = GapMetric.of(gap).weights(gap)
    size = np.nansum((gap.mean[rows] / gap.tolerance) ** 2 * weight, axis=1)
    extrapolated = corner_of_factors(
        [gap.record.configurations[row].factors for row in rows], np.sqrt(size)
    )
    return None if extrapolated is None else rows[extrapolated.rows]
