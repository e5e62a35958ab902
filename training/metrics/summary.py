"""Mean errors over held-out pulses with their bootstrap intervals."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .clusters import bootstrap_interval, clustered
from .errors import PulseErrors


@dataclass(frozen=True)
class Estimate:
    """A mean and its 90 % interval; NaN ends where a single configuration tells nothing of another."""

    mean: float
    low: float
    high: float


def summary(
    errors: PulseErrors,
    configuration: NDArray[Any],
    rng: np.random.Generator,
    resamples: int = 2000,
) -> dict[str, Estimate]:
    """Mean over pulses of every metric there is, coverage included.

    The interval draws configurations (n,), not pulses: repetitions of a configuration err alike. It is that of the
    mean over configurations like these with the model as it is; another training set is not drawn.
    """
    arrays = errors.arrays()
    clusters = clustered(np.stack(list(arrays.values()), axis=1), configuration)
    low, high = bootstrap_interval(clusters, rng, resamples)
    rows = zip(arrays, clusters.mean, low, high, strict=True)
    return {name: Estimate(float(mean), float(least), float(most)) for name, mean, least, most in rows}
