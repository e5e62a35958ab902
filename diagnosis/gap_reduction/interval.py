"""The share of the gap that disappears, and how sure it is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

RESAMPLES = 2000
COVERAGE = 0.90


def fraction(before: Floats, after: Floats, floor: Floats) -> Floats:
    """Of mean squares before, after and by chance (...): (b - a) / (b - f) of their roots, NaN where b <= f.

    The roots are what the report prints, so that its numbers agree with each other.
    """
    b, a, f = np.sqrt(before), np.sqrt(after), np.sqrt(floor)
    room = b - f
    return np.asarray(np.where(room > 0, (b - a) / np.where(room > 0, room, 1.0), np.nan))


@dataclass(frozen=True)
class Unsure:
    """What resampling configurations does not see.

    `floor`: relative standard deviation of the scatter's mean square, which few repetitions measured. `training`: of
    the fraction, because other training configurations would have given other parameters to all that are held out.
    """

    floor: float = 0.0
    training: float = 0.0


def fraction_interval(
    before: Floats,
    after: Floats,
    floor: Floats,
    rng: np.random.Generator,
    unsure: Unsure = Unsure(),
    resamples: int = RESAMPLES,
) -> tuple[float, float] | None:
    """90 % interval from squares (C,) of held-out configurations, whole configurations drawn with replacement.

    Bias-corrected and accelerated (Efron, JASA 82 (1987) 171), widened about the estimate by sqrt(C / (C - 1)) and by
    Student's t over the normal quantile, since C drawn configurations scatter too little, and by what is `unsure`
    besides; not beyond 1. None with fewer than three configurations.
    """
    cells = len(before)
    table = np.stack([before, after, floor])
    estimate = float(fraction(*table.mean(axis=1)))
    if cells < 3 or not np.isfinite(estimate):
        return None
    drawn = rng.multinomial(cells, np.full(cells, 1 / cells), size=resamples).T / cells
    means = table @ drawn
    means[2] *= np.maximum(0.0, 1.0 + unsure.floor * rng.standard_normal(resamples))
    values = fraction(*means)
    values = values[np.isfinite(values)]
    if len(values) < resamples // 2:
        return None
    low, high = np.quantile(values, _levels(values, estimate, _jackknifed(table)))
    wider = _wider(cells, float(values.std()), unsure.training)
    ends = (
        estimate + wider * (min(float(low), estimate) - estimate),
        estimate + wider * (max(float(high), estimate) - estimate),
    )
    return ends[0], min(ends[1], max(1.0, estimate))


def _wider(cells: int, spread: float, training: float) -> float:
    from scipy.stats import norm, t

    tail = (1 - COVERAGE) / 2
    small = np.sqrt(cells / (cells - 1)) * t.ppf(1 - tail, cells - 1) / norm.ppf(1 - tail)
    return float(small * np.sqrt(1 + (training / max(spread, 1e-12)) ** 2)) if spread > 0 else float(small)


def _jackknifed(table: Floats) -> Floats:
    cells = table.shape[1]
    return fraction(*((table.sum(axis=1, keepdims=True) - table) / (cells - 1)))


def _levels(values: Floats, estimate: float, left_out: Floats) -> Floats:
    """At which quantiles are read."""
    from scipy.stats import norm

    tail = (1 - COVERAGE) / 2
    share = np.clip(np.mean(values < estimate), 1 / len(values), 1 - 1 / len(values))
    shift = norm.ppf(share)
    left_out = left_out[np.isfinite(left_out)]
    away = left_out.mean() - left_out if len(left_out) else np.zeros(1)
    acceleration = (away**3).sum() / np.maximum(6 * (away**2).sum() ** 1.5, 1e-300)
    z = shift + norm.ppf([tail, 1 - tail])
    return np.asarray(norm.cdf(shift + z / np.maximum(1 - acceleration * z, 0.05)))
