"""Whether a mean difference is beyond chance."""

from __future__ import annotations

import numpy as np

from ...array_types import Floats
from .clusters import Clusters

#: Up to this many clusters every combination of signs is tried.
_EXACT = 12


def sign_flip_p(clusters: Clusters, rng: np.random.Generator, draws: int = 4999) -> Floats:
    """Two-sided p-values (m,) of the hypothesis that each cluster's sum might as well have the other sign."""
    k = len(clusters)
    observed = np.abs(clusters.sums.sum(axis=0)) * (1 - 1e-12)  # sums in another order are no other sums
    if k <= _EXACT:
        signs = 1.0 - 2.0 * ((np.arange(2**k)[:, None] >> np.arange(k)) & 1)
        exact: Floats = np.mean(np.abs(signs @ clusters.sums) >= observed, axis=0)
        return exact
    signs = rng.choice([-1.0, 1.0], size=(draws, k))
    hits = np.count_nonzero(np.abs(signs @ clusters.sums) >= observed, axis=0)
    p_values: Floats = (1.0 + hits) / (1.0 + draws)
    return p_values


def holm(p_values: Floats) -> Floats:
    """The same p-values (q,) for somebody who asked q questions (Holm, Scand. J. Statist. 6, 1979, 65)."""
    order = np.argsort(p_values)
    corrected = np.empty_like(p_values)
    corrected[order] = np.maximum.accumulate(np.minimum(1.0, np.arange(len(p_values), 0, -1) * p_values[order]))
    return corrected
