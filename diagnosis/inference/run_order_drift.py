"""How a campaign drifts from its first run to its last within its configurations: their means hide it.

Where runs are shuffled, each configuration's mean is that of the middle of the day, and what drifts looks steady. How
repetitions lean on their place in the order says otherwise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from ...array_types import Floats, Rows
from ..gap import GapTable

#: Range, in shares of the order of runs, over which something drifts.
_LENGTH = 0.4
#: Smaller eigenvalues of it, over the largest, are left out.
_KEPT = 1e-3
#: Below this sum of squared places about their configuration's mean repetitions stand too close to say anything.
_SPREAD = 0.05
#: A simulator may drift by so many tolerances over the day, in what scatters together together.
_STEADY = 0.3


@dataclass(frozen=True, eq=False)
class RunOrderDrift:
    """`slope` (d,) of the observables `columns` (d,) over the whole order of runs, about the means of configurations,
    in tolerances; `noise` is that of the slopes.

    Of something that drifts with variance 1, `means` (C, k) says what configurations' means have in common.
    """

    slope: Floats
    columns: Rows
    noise: Floats
    means: Floats

    def log_gains(self, amplitudes: Sequence[float]) -> list[float]:
        """For each size of a drift, in tolerances: log evidence of the slopes with it less that without."""
        if not len(self.columns):
            return [0.0 for _ in amplitudes]
        root = np.linalg.cholesky(self.noise)
        white = np.linalg.solve(root, self.slope)
        # what drifts has one size in all observables of a stage, or one of its own in each
        own = np.linalg.solve(root, np.eye(len(self.slope)))
        together = np.linalg.solve(root, np.ones((len(self.slope), 1)))
        return [
            float(np.logaddexp(_log_gain(white, size * own), _log_gain(white, size * together)) - np.log(2))
            for size in amplitudes
        ]

    @classmethod
    def of(cls, gap: GapTable) -> Self:
        of, order = gap.record.configuration_of, np.array([run.order for run in gap.record.runs], dtype=np.float64)
        here = np.isfinite(gap.residuals).any(axis=1)
        time = (order - order.min()) / max(float(np.ptp(order)), 1.0)
        time, residuals = time[here], gap.residuals[here]
        member = (of[here][None, :] == np.arange(len(gap.mean))[:, None]).astype(np.float64)  # (C, R)
        finite = np.isfinite(residuals).astype(np.float64)
        off = _about(np.where(finite > 0, time[:, None], 0.0), finite, member)
        power = (off**2).sum(axis=0)
        columns = np.flatnonzero(power > _SPREAD)
        tolerance, power = gap.tolerance[columns], power[columns]
        slope = (off * np.nan_to_num(residuals)).sum(axis=0)[columns] / power / tolerance
        scatter = gap.noise.covariance[np.ix_(columns, columns)] / np.outer(tolerance, tolerance)
        size = np.sqrt(np.diag(scatter))
        covariance = scatter / np.sqrt(np.outer(power, power)) + _STEADY**2 * scatter / np.outer(size, size)
        means = _drifting(time, member)
        return cls(slope, columns, covariance, means)


def _about(values: Floats, known: Floats, member: Floats) -> Floats:
    """(R, D) less the mean over the known runs of their configuration; 0 where there is none."""
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = np.nan_to_num((member @ values) / (member @ known))
    return np.asarray((values - member.T @ mean) * known)


def _drifting(time: Floats, member: Floats) -> Floats:
    """(C, k), of runs at `time` (R,) that are members (C, R) of configurations: what means have of a smooth drift."""
    share = member / np.maximum(member.sum(axis=1, keepdims=True), 1.0)
    kernel = 0.5 + 0.5 * np.exp(-0.5 * (time[:, None] - time[None, :]) ** 2 / _LENGTH**2)
    values, vectors = np.linalg.eigh(share @ kernel @ share.T)
    kept = values > _KEPT * values.max()
    return np.asarray(vectors[:, kept] * np.sqrt(values[kept]))


def _log_gain(white: Floats, directions: Floats) -> float:
    """log N(white; 0, I + U U') - log N(white; 0, I)."""
    matrix = np.eye(directions.shape[1]) + directions.T @ directions
    along = directions.T @ white
    return 0.5 * float(along @ np.linalg.solve(matrix, along)) - 0.5 * float(np.linalg.slogdet(matrix)[1])
