"""A gap that no effect explains: how much likelier the data are if something else acts besides a
set of effects.

Something else may act in one stage, by a few to a hundred tolerances: alike in all configurations,
smoothly over the factors, from one configuration to the next, in one level of a factor, beyond a
limit of how hard a run is, or more and more over the order of runs. Each way is as likely as any
other.

How a campaign drifts from its first run to its last within its configurations: their means hide it.

Where runs are shuffled, each configuration's mean is that of the middle of the day, and what drifts
looks steady. How repetitions lean on their place in the order says otherwise.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats, Rows
from ..gap import GapTable
from .model_error import LENGTH, squared_distances
from .problem import StageBlock
from .subset_fit import SubsetFit, covariance, factor, residual, whitened

#: Range, in shares of the order of runs, over which something drifts.
_LENGTH = 0.4
#: Smaller eigenvalues of it, over the largest, are left out.
_KEPT = 1e-3
#: Below this sum of squared places about their configuration's mean repetitions stand too close to
#: say anything.
_SPREAD = 0.05
#: A simulator may drift by so many tolerances over the day, in what scatters together together.
_STEADY = 0.3


@dataclass(frozen=True, eq=False)
class RunOrderDrift:
    """`slope` (d,) of the observables `columns` (d,) over the whole order of runs, about the means
    of configurations, in tolerances; `noise` is that of the slopes.

    Of something that drifts with variance 1, `means` (C, k) says what configurations' means have in
    common.
    """

    slope: Floats
    columns: Rows
    noise: Floats
    means: Floats

    def log_gains(self, amplitudes: Sequence[float]) -> list[float]:
        """For each size of a drift, in tolerances: log evidence of the slopes with it less that
        without."""
        if not len(self.columns):
            return [0.0 for _ in amplitudes]
        root = np.linalg.cholesky(self.noise)
        white = np.linalg.solve(root, self.slope)
        # what drifts has one size in all observables of a stage, or one of its own in each
        own = np.linalg.solve(root, np.eye(len(self.slope)))
        together = np.linalg.solve(root, np.ones((len(self.slope), 1)))
        return [
            float(
                np.logaddexp(_log_gain(white, size * own), _log_gain(white, size * together))
                - np.log(2)
            )
            for size in amplitudes
        ]

    @classmethod
    def of(cls, gap: GapTable) -> Self:
        of, order = (
            gap.record.configuration_of,
            np.array([run.order for run in gap.record.runs], dtype=np.float64),
        )
        here = np.isfinite(gap.residuals).any(axis=1)
        time = (order - order.min()) / max(float(np.ptp(order)), 1.0)
        time, residuals = time[here], gap.residuals[here]
        member = (of[here][None, :] == np.arange(len(gap.mean))[:, None]).astype(
            np.float64
        )  # (C, R)
        finite = np.isfinite(residuals).astype(np.float64)
        off = _about(np.where(finite > 0, time[:, None], 0.0), finite, member)
        power = (off**2).sum(axis=0)
        columns = np.flatnonzero(power > _SPREAD)
        tolerance, power = gap.tolerance[columns], power[columns]
        slope = (off * np.nan_to_num(residuals)).sum(axis=0)[columns] / power / tolerance
        scatter = gap.noise.covariance[np.ix_(columns, columns)] / np.outer(tolerance, tolerance)
        size = np.sqrt(np.diag(scatter))
        covariance = scatter / np.sqrt(np.outer(power, power)) + _STEADY**2 * scatter / np.outer(
            size, size
        )
        means = _drifting(time, member)
        return cls(slope, columns, covariance, means)


def _about(values: Floats, known_mean: Floats, member: Floats) -> Floats:
    """(R, D) less the mean over the known runs of their configuration; 0 where there is none."""
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = np.nan_to_num((member @ values) / (member @ known_mean))
    return np.asarray((values - member.T @ mean) * known_mean)


def _drifting(time: Floats, member: Floats) -> Floats:
    """(C, k), of runs at `time` (R,) that are members (C, R) of configurations: what means have of
    a smooth drift."""
    share = member / np.maximum(member.sum(axis=1, keepdims=True), 1.0)
    kernel = 0.5 + 0.5 * np.exp(-0.5 * (time[:, None] - time[None, :]) ** 2 / _LENGTH**2)
    values, vectors = np.linalg.eigh(share @ kernel @ share.T)
    kept = values > _KEPT * values.max()
    return np.asarray(vectors[:, kept] * np.sqrt(values[kept]))


def _log_gain(white: Floats, directions: Floats) -> float:
    """log N(white; 0, I + U U') - log N(white; 0, I)."""
    matrix = np.eye(directions.shape[1]) + directions.T @ directions
    along = directions.T @ white
    return 0.5 * float(along @ np.linalg.solve(matrix, along)) - 0.5 * float(
        np.linalg.slogdet(matrix)[1]
    )


#: Sizes of what is not explained, in tolerances.
AMPLITUDES = (1.5, 4.0, 10.0, 30.0)
#: What a level limits begins at these shares of the configurations.
_LIMITS = (0.25, 0.5, 0.75)
#: A smaller difference of how hard runs are, in logarithms, is none.
_ALIKE = 1e-6
#: Share of what is unexplained that all configurations have in common, in a smooth pattern.
_COMMON = 0.5
#: Share of its variance that all observables of a stage have in common, where each is off by
#: itself.
_SHARED = 0.3


@dataclass(frozen=True, eq=False)
class ConfigurationPattern:
    """`covariance` (C, C) of variance one where it acts; `drift`: over the order of runs, which
    repetitions show."""

    name: str
    covariance: Floats
    drift: bool = False


def configuration_patterns(
    gap: GapTable, stage: str, drift: RunOrderDrift
) -> list[ConfigurationPattern]:
    """All ways in which something may spread over the configurations of a gap table."""
    factors = [configuration.factors for configuration in gap.record.configurations]
    count = len(factors)
    distance = squared_distances(factors)
    smooth = _COMMON + (1 - _COMMON) * np.exp(-0.5 * distance / LENGTH**2)
    rough = np.exp(-0.5 * distance / (0.4 * LENGTH) ** 2)
    patterns = [
        ConfigurationPattern("all configurations alike", np.ones((count, count))),
        ConfigurationPattern("smooth over the factors", smooth),
        ConfigurationPattern("rough over the factors", rough),
        ConfigurationPattern("from configuration to configuration", np.eye(count)),
        ConfigurationPattern("over the order of runs", drift.means @ drift.means.T, True),
    ]
    for rule, inside in factor_levels(factors):
        patterns.append(ConfigurationPattern(rule, np.outer(inside, inside).astype(np.float64)))
    for start, ramp in _ramps(gap.loudness[stage]):
        patterns.append(
            ConfigurationPattern(
                f"beyond the quantile {start:g} of how hard runs are", np.outer(ramp, ramp)
            )
        )
    return patterns


def factor_levels(
    factors: Sequence[Mapping[str, str | float]],
) -> list[tuple[str, NDArray[np.bool_]]]:
    """Rules "name = level" and the configurations (C,) that they hold for; two at least, and two
    others."""
    rules: dict[bytes, tuple[str, NDArray[np.bool_]]] = {}
    for name in sorted({name for row in factors for name in row}):
        values = [row.get(name, "") for row in factors]
        for level in dict.fromkeys(values):
            inside = np.array([value == level for value in values])
            if 2 <= inside.sum() <= len(values) - 2:
                rules.setdefault(inside.tobytes(), (f"{name} = {level}", inside))
    return list(rules.values())


def _ramps(loudness: Floats) -> list[tuple[float, Floats]]:
    finite = np.isfinite(loudness)
    if finite.sum() < 3 or np.ptp(loudness[finite]) < _ALIKE:
        return []
    ramps = []
    for share in _LIMITS:
        ramp = np.where(
            finite,
            np.maximum(np.nan_to_num(loudness) - np.quantile(loudness[finite], share), 0.0),
            0.0,
        )
        if (ramp > _ALIKE).sum() >= 2:
            ramps.append((share, ramp / np.sqrt((ramp[ramp > 0] ** 2).mean())))
    return ramps


@dataclass(frozen=True)
class UnexplainedEvidence:
    """`gain`: log evidence with something unexplained in `stage` besides a set of effects, less
    that without; `pattern` is the likeliest way."""

    gain: float
    stage: str
    pattern: str


def unexplained_evidence(
    gap: GapTable, blocks: Sequence[StageBlock], fit: SubsetFit, drift: RunOrderDrift
) -> UnexplainedEvidence:
    """Of one fitted set, over all stages, patterns and sizes."""
    from scipy.linalg import solve_triangular

    gains: list[tuple[float, str, str]] = []
    slope_gain = drift.log_gains(AMPLITUDES)
    for index, block in enumerate(blocks):
        base = covariance(block, fit.contributions[index], fit.errors[index])
        residuals = residual(block, fit.change[index])
        # parameters of the effects adapt to what is unexplained, as they do without it
        free = base + fit.jacobian[index] @ fit.jacobian[index].T
        start = residuals + fit.jacobian[index] @ fit.u
        plain = _log_density(free, start)
        lower = np.linalg.cholesky(free)
        white = solve_triangular(lower, start, lower=True)
        columns, at = np.unique(block.observable, return_inverse=True)
        for pattern in configuration_patterns(gap, block.stage, drift):
            drifts = slope_gain if pattern.drift else [0.0] * len(AMPLITUDES)
            # all amplitudes and durations of the stage together
            root = (
                _root(pattern.covariance)[block.configuration]
                * np.where(block.detail, 0.3, 1.0)[:, None]
            )
            directions = solve_triangular(lower, root, lower=True)
            inner, turn = np.linalg.eigh(directions.T @ directions)
            along = turn.T @ (directions.T @ white)
            for size, slope in zip(AMPLITUDES, drifts, strict=True):
                spread = 1 + size**2 * np.maximum(inner, 0)
                gain = 0.5 * float(np.sum(size**2 * along**2 / spread)) - 0.5 * float(
                    np.log(spread).sum()
                )
                gains.append((gain + slope, block.stage, pattern.name))
            if len(columns) > 1:  # in each observable by itself
                own = pattern.covariance[np.ix_(block.configuration, block.configuration)]
                own = own * (_SHARED + (1 - _SHARED) * (at[:, None] == at[None, :]))
                for size, slope in zip(AMPLITUDES, drifts, strict=True):
                    gain = _log_density(free + size**2 * own, start) - plain
                    gains.append((gain + slope, block.stage, pattern.name))
    logs = np.array([gain for gain, _, _ in gains])
    best = gains[int(logs.argmax())]
    top = float(logs.max())
    return UnexplainedEvidence(top + float(np.log(np.mean(np.exp(logs - top)))), best[1], best[2])


def _log_density(matrix: Floats, values: Floats) -> float:
    """log N(values; 0, matrix), up to a constant."""
    lower = factor(matrix)
    white = whitened(lower, values)
    return -0.5 * float(white @ white) - float(np.log(np.diag(lower)).sum())


def _root(matrix: Floats) -> Floats:
    """(C, k): a root of a covariance (C, C) that may be singular."""
    values, vectors = np.linalg.eigh(matrix)
    kept = values > 1e-6 * values.max()
    return np.asarray(vectors[:, kept] * np.sqrt(values[kept]))
