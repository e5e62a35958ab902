"""Mean errors over held-out pulses with their bootstrap intervals.

Means over pulses whose repetitions belong together: what the bootstrap and the permutation test
share.

Whether a mean difference is beyond chance.

The continuous ranked probability score: how far a predicted distribution lies from the value that
was measured.

The share of an error above its noise that disappears, and how sure it is.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from .metrics import SHARES, PulseErrors

#: Of the intervals that are told.
COVERAGE = 0.90


@dataclass(frozen=True, eq=False)
class Clusters:
    """Pulses summed by cluster: `sums` (k x m) of m quantities, `sizes` (k,) in pulses."""

    sums: Floats
    sizes: Floats

    def __len__(self) -> int:
        return len(self.sizes)

    @property
    def mean(self) -> Floats:
        """Mean over all pulses, (m,)."""
        return np.asarray(self.sums.sum(axis=0) / self.sizes.sum())


def clustered(values: Floats, labels: NDArray[Any]) -> Clusters:
    """Values summed by label.

    Parameters:
        values: Values (n, m) of m quantities, a row for each pulse.
        labels: The cluster (n,) of each pulse.

    Raises:
        ValueError: Where their lengths differ or nothing is given.
    """
    if len(values) != len(labels) or len(labels) == 0:
        raise ValueError(
            f"{len(values)} values and {len(labels)} labels: give one label a "
            f"pulse, and at least one"
        )
    names, member = np.unique(labels, return_inverse=True)
    sums = np.zeros((len(names), values.shape[1]))
    np.add.at(sums, member, values)
    return Clusters(sums, np.bincount(member).astype(np.float64))


def bootstrap_interval(
    clusters: Clusters, rng: np.random.Generator, resamples: int
) -> tuple[Floats, Floats]:
    """The 90 % interval of the mean, from whole clusters drawn with replacement.

    Percentiles, widened about the mean by sqrt(k / (k - 1)): the variance of k drawn clusters is (k
    - 1) / k of what it should be.

    Parameters:
        clusters: Pulses summed by cluster, k clusters of m quantities.
        rng: The generator that draws clusters.
        resamples: How often k clusters are drawn.

    Returns:
        Low and high end (m,), NaN for one cluster.

    Source:
        Davison and Hinkley, Bootstrap Methods and their Application, 1997, chapter 5.
    """
    k, mean = len(clusters), clusters.mean
    if k < 2:
        return np.full_like(mean, np.nan), np.full_like(mean, np.nan)
    low, high = _percentiles(clusters, rng, resamples)
    wider = np.sqrt(k / (k - 1))
    return mean + wider * (low - mean), mean + wider * (high - mean)


def _percentiles(
    clusters: Clusters, rng: np.random.Generator, resamples: int
) -> tuple[Floats, Floats]:
    k = len(clusters)
    drawn = rng.multinomial(k, np.full(k, 1.0 / k), size=resamples).astype(np.float64)
    means = (drawn @ clusters.sums) / (drawn @ clusters.sizes)[:, None]
    tail = (1 - COVERAGE) / 2
    low, high = np.quantile(means, [tail, 1 - tail], axis=0)
    return low, high


def positive_interval(
    clusters: Clusters, rng: np.random.Generator, resamples: int
) -> tuple[Floats, Floats]:
    """The 90 % interval of the mean of quantities that are never negative, such as errors. It has
    the draws of `bootstrap_interval`, and is widened on the log scale, so that it is above 0.

    Errors are skewed, and few configurations scatter too little: widened by Student's t over the
    normal quantile, too.

    Parameters:
        clusters: Pulses summed by cluster, k clusters of m quantities.
        rng: The generator that draws clusters.
        resamples: How often k clusters are drawn.

    Returns:
        Low and high end (m,), NaN for one cluster.
    """
    from scipy.stats import norm, t

    k, mean = len(clusters), clusters.mean
    if k < 2:
        return np.full_like(mean, np.nan), np.full_like(mean, np.nan)
    tail = (1 - COVERAGE) / 2
    wider = np.sqrt(k / (k - 1)) * t.ppf(1 - tail, k - 1) / norm.ppf(1 - tail)
    scale = np.where(mean > 0, mean, 1.0)  # of errors that are all zero, the interval is zero
    low, high = (mean * (end / scale) ** wider for end in _percentiles(clusters, rng, resamples))
    return np.asarray(low), np.asarray(high)


def share_interval(clusters: Clusters) -> tuple[Floats, Floats]:
    """The 90 % interval of the mean of shares, such as coverages: within 0 and 1, and not empty
    where all pulses agree.

    Wilson's interval with as many independent trials as would scatter like the clusters, as many as
    clusters where these do not differ, and Student's t for the normal quantile.

    Parameters:
        clusters: Pulses summed by cluster, k clusters of m shares.

    Returns:
        Low and high end (m,), NaN for one cluster.

    Source:
        Wilson, J. Am. Stat. Assoc. 22 (1927) 209; Korn and Graubard, Survey Methodology 24 (1998)
        193.
    """
    from scipy.stats import t

    k, share = len(clusters), clusters.mean
    if k < 2:
        return np.full_like(share, np.nan), np.full_like(share, np.nan)
    deviation = clusters.sums - share * clusters.sizes[:, None]
    variance = (deviation**2).sum(axis=0) / clusters.sizes.sum() ** 2 * k / (k - 1)
    binomial = np.clip(share * (1 - share), 0.0, None)
    differ = (variance > 1e-15) & (binomial > 0)
    trials = np.where(differ, binomial / np.where(differ, variance, 1.0), k)
    quantile = t.ppf(1 - (1 - COVERAGE) / 2, k - 1)
    shrinkage = quantile**2 / trials
    middle = (share + shrinkage / 2) / (1 + shrinkage)
    half = quantile / (1 + shrinkage) * np.sqrt(binomial / trials + shrinkage / (4 * trials))
    return np.clip(middle - half, 0.0, 1.0), np.clip(middle + half, 0.0, 1.0)


@dataclass(frozen=True)
class Estimate:
    """A mean and its 90 % interval; NaN ends where a single configuration tells nothing of
    another."""

    mean: float
    low: float
    high: float


def summary(
    errors: PulseErrors,
    configuration: NDArray[Any],
    rng: np.random.Generator,
    resamples: int = 2000,
) -> dict[str, Estimate]:
    """Mean over pulses of every metric there is, coverage included, with its 90 % interval.

    The interval is that of the mean over configurations like these with the model as it is; another
    training set is not drawn. Intervals of errors are above zero, those of shares within 0 and 1.

    Parameters:
        errors: What n predicted pulses differ by from the measured ones.
        configuration: The configuration (n,) of each pulse. Configurations are drawn and not
            pulses, because repetitions of a configuration err alike.
        rng: The generator that draws configurations.
        resamples: How often configurations are drawn; by default 2000 times.
    """
    arrays = errors.arrays()
    clusters = clustered(np.stack(list(arrays.values()), axis=1), configuration)
    is_share = np.array([name in SHARES for name in arrays])
    ends = zip(share_interval(clusters), positive_interval(clusters, rng, resamples), strict=True)
    low, high = (np.where(is_share, of_share, of_error) for of_share, of_error in ends)
    rows = zip(arrays, clusters.mean, low, high, strict=True)
    return {
        name: Estimate(float(mean), float(least), float(most)) for name, mean, least, most in rows
    }


#: Up to this many clusters every combination of signs is tried.
_EXACT = 12


def sign_flip_p(clusters: Clusters, rng: np.random.Generator, draws: int = 4999) -> Floats:
    """Two-sided p-values of the hypothesis that each cluster's sum might as well have the other
    sign.

    Parameters:
        clusters: Pulses summed by cluster, k clusters of m quantities.
        rng: The generator that draws signs. Up to 12 clusters it is not used, since every
            combination of signs is tried.
        draws: The number of combinations that are drawn; by default 4999.

    Returns:
        p-values (m,).
    """
    k = len(clusters)
    observed = np.abs(clusters.sums.sum(axis=0)) * (
        1 - 1e-12
    )  # sums in another order are no other sums
    if k <= _EXACT:
        signs = 1.0 - 2.0 * ((np.arange(2**k)[:, None] >> np.arange(k)) & 1)
        return np.asarray(np.mean(np.abs(signs @ clusters.sums) >= observed, axis=0))
    signs = rng.choice([-1.0, 1.0], size=(draws, k))
    hits = np.count_nonzero(np.abs(signs @ clusters.sums) >= observed, axis=0)
    return np.asarray((1.0 + hits) / (1.0 + draws))


#: Variance of a mean difference that is due to which pulses the models happened to learn from, over
#: the variance of the difference between clusters. Nadeau and Bengio's rule gives 0.25 for five
#: folds; pairs of equal models, taught by different repetitions of the same configurations, showed
#: less than 0.1 (`python -m benchmarks.prediction_coverage`).
TRAINING_VARIANCE = 0.1


def corrected_p(clusters: Clusters) -> Floats:
    """Two-sided p-values of mean differences between models that were trained on overlapping
    pulses.

    The corrected resampled t-test over the means of k clusters: t = d / (s sqrt(1 / k +
    `TRAINING_VARIANCE`)), k - 1 degrees of freedom. A sign-flip test takes the models as given, and
    calls the luck of what they learned from a difference.

    Parameters:
        clusters: Differences summed by cluster, k clusters of m quantities.

    Returns:
        p-values (m,), 1 for a single cluster.

    Source:
        Nadeau and Bengio, Mach. Learn. 52 (2003) 239, eq. 9.
    """
    from scipy.stats import t

    k, means = len(clusters), clusters.sums / clusters.sizes[:, None]
    if k < 2:
        return np.ones(means.shape[1])
    width = means.std(axis=0, ddof=1) * np.sqrt(1 / k + TRAINING_VARIANCE)
    mean = np.abs(means.mean(axis=0))
    ratio = np.divide(mean, width, out=np.where(mean > 0, np.inf, 0.0), where=width > 0)
    return np.asarray(2 * t.sf(ratio, k - 1))


def least_p_value(clusters: int) -> float:
    """The least p-value that `sign_flip_p` can give: all sums have one sign, or all the other.

    Parameters:
        clusters: The number of clusters.
    """
    return float(min(1.0, 2.0 ** (1 - clusters)))


def holm(p_values: Floats) -> Floats:
    """p-values that are corrected for the number of questions that were asked.

    Parameters:
        p_values: The p-value (q,) of each of q questions by itself.

    Returns:
        The corrected p-values (q,), in the same order.

    Source:
        Holm, Scand. J. Statist. 6 (1979) 65.
    """
    order = np.argsort(p_values)
    corrected = np.empty_like(p_values)
    corrected[order] = np.maximum.accumulate(
        np.minimum(1.0, np.arange(len(p_values), 0, -1) * p_values[order])
    )
    return corrected


def ensemble_crps(draws: Floats, measured: Floats) -> Floats:
    """The continuous ranked probability score E|X - y| - E|X - X'| / 2 of predictions that are
    given as draws; the smaller, the better.

    The second mean is taken over pairs of different draws, so that its expectation does not depend
    on their number. A single draw is scored by its absolute error.

    Parameters:
        draws: Predicted values (d, n), d draws of each.
        measured: Measured values (n,), in the same unit.

    Returns:
        Scores (n,) in the unit of the values.

    Raises:
        ValueError: For arrays of other shapes.

    Source:
        Gneiting and Raftery, J. Am. Stat. Assoc. 102 (2007) 359, eq. 21; Ferro, Q. J. R. Meteorol.
        Soc. 140 (2014) 1917.
    """
    if draws.ndim != 2 or draws.shape[1:] != measured.shape:
        raise ValueError(
            f"draws are {draws.shape} and measured values {measured.shape}: "
            f"expected (d, n) and (n,)"
        )
    count = draws.shape[0]
    distance = np.abs(draws - measured).mean(axis=0)
    if count == 1:
        return np.asarray(distance)
    # The sum of |x_i - x_j| over all pairs of sorted draws is that of 2 (2 i - d - 1) x_i.
    weights = (2 * np.arange(1, count + 1) - count - 1) / (count * (count - 1))
    return np.asarray(distance - weights @ np.sort(draws, axis=0))


_RESAMPLES = 2000


def fraction(before: Floats | float, after: Floats | float, floor: Floats | float) -> Floats:
    """The share of an error above its noise that disappears: (b - a) / (b - f) of the roots.

    The roots are what the report prints, so that its numbers agree with each other.

    Parameters:
        before: Mean squares b before the change, of any shape.
        after: Mean squares a after it, of the same shape.
        floor: Mean squares f by chance alone, of the same shape.

    Returns:
        The shares, NaN where b <= f.
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
    """The 90 % interval of a `fraction`, from held-out configurations of which whole ones are drawn
    with replacement.

    Bias-corrected and accelerated, widened about the estimate by sqrt(C / (C - 1)) and by Student's
    t over the normal quantile, since C drawn configurations scatter too little, and by what
    resampling does not see; not beyond 1.

    Parameters:
        before: Squares (C,) of the error before the change, one for each configuration.
        after: Squares (C,) after it.
        floor: Squares (C,) by chance alone.
        rng: The generator that draws configurations.
        floor_error: The relative standard deviation of the scatter's mean square, which few
            repetitions measured; by default 0.
        training_error: The standard deviation of the fraction, because other training
            configurations would have given other parameters to all that are held out; by default 0.

    Returns:
        Low and high end; None with fewer than three configurations, and where the fraction is not
        finite.

    Source:
        Efron, JASA 82 (1987) 171.
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
    low, high = np.quantile(
        values, _quantiles(values, estimate, jackknife[np.isfinite(jackknife)], tail)
    )
    wider = np.sqrt(cells / (cells - 1)) * t.ppf(1 - tail, cells - 1) / norm.ppf(1 - tail)
    if values.std() > 0:
        wider *= np.sqrt(1 + (training_error / max(float(values.std()), 1e-12)) ** 2)
    lower, upper = (
        float(estimate + wider * (end - estimate))
        for end in (min(low, estimate), max(high, estimate))
    )
    return lower, min(upper, max(1.0, estimate))


def _quantiles(values: Floats, estimate: float, jackknife: Floats, tail: float) -> Floats:
    """(2,): which quantiles of the drawn values are the interval; `jackknife` (n,) leave a
    configuration out each."""
    from scipy.stats import norm

    share = np.clip(np.mean(values < estimate), 1 / len(values), 1 - 1 / len(values))
    shift = norm.ppf(share)
    deviation = jackknife.mean() - jackknife if len(jackknife) else np.zeros(1)
    acceleration = (deviation**3).sum() / np.maximum(6 * (deviation**2).sum() ** 1.5, 1e-300)
    z = shift + norm.ppf([tail, 1 - tail])
    return np.asarray(norm.cdf(shift + z / np.maximum(1 - acceleration * z, 0.05)))
