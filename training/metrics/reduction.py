"""The share of an error above its noise that disappears, and how sure it is."""

from __future__ import annotations

import numpy as np

from ...array_types import Floats
from .clusters import COVERAGE

_RESAMPLES = 2000


def fraction(before: Floats | float, after: Floats | float, floor: Floats | float) -> Floats:
    """Of mean squares before, after and by chance (...): (b - a) / (b - f) of their roots, NaN where b <= f.

    The roots are what the report prints, so that its numbers agree with each other.
    """
    b, a, f = np.sqrt(before), np.sqrt(after), np.sqrt(floor)
    return np.asarray((b - a) / np.where(b > f, b - f, np.nan))


def fraction_interval(
    before: Floats,
    after: Floats,
    floor: Floats,
    rng: np.random.Generator,
    floor_error: float = 0.0,
    training_error: float = 0.0,
) -> tuple[float, float] | None:
    """90 % interval from squares (C,) of held-out configurations, whole configurations drawn with replacement.

    Bias-corrected and accelerated (Efron, JASA 82 (1987) 171), widened about the estimate by sqrt(C / (C - 1)) and by
    Student's t over the normal quantile, since C drawn configurations scatter too little, and by what resampling does
    not see; not beyond 1. `floor_error`: relative standard deviation of the scatter's mean square, which few
    repetitions measured. `training_error`: standard deviation of the fraction, because other training configurations
    would have given other parameters to all that are held out. None with fewer than three configurations.
    """
    from scipy.stats import norm, t

    cells, tail = len(before), (1 - COVERAGE) / 2
    table = np.stack([before, after, floor])
    estimate = float(fraction(*table.mean(axis=1)))
    if cells < 3 or not np.isfinite(estimate):
        return None
    means = table @ (rng.multinomial(cells, np.full(cells, 1 / cells), size=_RESAMPLES).T / cells)
    means[2] *= np.maximum(0.0, 1.0 + floor_error * rng.standard_normal(_RESAMPLES))
    values = fraction(*means)
    values = values[np.isfinite(values)]
    if len(values) < _RESAMPLES // 2:
        return None
    jackknife = fraction(*((table.sum(axis=1, keepdims=True) - table) / (cells - 1)))
    low, high = np.quantile(values, _quantiles(values, estimate, jackknife[np.isfinite(jackknife)], tail))
    wider = np.sqrt(cells / (cells - 1)) * t.ppf(1 - tail, cells - 1) / norm.ppf(1 - tail)
    if values.std() > 0:
        wider *= np.sqrt(1 + (training_error / max(float(values.std()), 1e-12)) ** 2)
    lower, upper = (float(estimate + wider * (end - estimate)) for end in (min(low, estimate), max(high, estimate)))
    return lower, min(upper, max(1.0, estimate))


def _quantiles(values: Floats, estimate: float, jackknife: Floats, tail: float) -> Floats:
    """(2,): which quantiles of the drawn values are the interval; `jackknife` (n,) leave a configuration out each."""
    from scipy.stats import norm

    share = np.clip(np.mean(values < estimate), 1 / len(values), 1 - 1 / len(values))
    shift = norm.ppf(share)
    deviation = jackknife.mean() - jackknife if len(jackknife) else np.zeros(1)
    acceleration = (deviation**3).sum() / np.maximum(6 * (deviation**2).sum() ** 1.5, 1e-300)
    z = shift + norm.ppf([tail, 1 - tail])
    return np.asarray(norm.cdf(shift + z / np.maximum(1 - acceleration * z, 0.05)))
