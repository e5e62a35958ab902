"""Whether the gap moves while a campaign goes on: a target that wears, a gain that warms up."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..stages.base import Observable
from .means import Floats

PERMUTATIONS = 999
LEVEL = 0.05
#: A drift over the campaign below this part of the tolerance is not worth a sentence.
_SMALL = 0.5


def drift(
    residual: Floats,
    configuration: NDArray[np.intp],
    order: NDArray[np.intp],
    observables: Sequence[Observable],
    rng: np.random.Generator,
    permutations: int = PERMUTATIONS,
    level: float = LEVEL,
) -> tuple[str, ...]:
    """A sentence for each stage whose residuals (R, d) have a trend over the order of runs; () where there is none.

    Means of configurations are taken off residual and order alike, so that a design that was not randomised makes no
    trend; then runs are permuted within configurations. p is of the steepest of all observables, corrected for that
    choice. Where nothing was repeated nothing can be told.
    """
    away = _centred(residual, configuration)
    time = _centred(order[:, None].astype(np.float64), configuration)
    known = np.isfinite(away).any(axis=1)
    if not known.any() or not np.abs(time[known]).any() or not np.nan_to_num(away).any():
        return ()
    values = np.nan_to_num(away)
    observed = _correlation(values, time[:, 0])
    top = np.array(
        [np.abs(_correlation(values, time[_within(configuration, rng), 0])).max() for _ in range(permutations)]
    )
    p_values = (1 + (top[:, None] >= np.abs(observed)).sum(axis=0)) / (1 + permutations)
    change = _slope(away, time[:, 0]) * float(np.ptp(order[known]))
    return _sentences(p_values, change, observables, level)


def _sentences(p_values: Floats, change: Floats, observables: Sequence[Observable], level: float) -> tuple[str, ...]:
    size = np.abs(change) / np.array([item.tolerance for item in observables])
    found = []
    for stage in dict.fromkeys(item.stage for item in observables):
        rows = [
            i for i, item in enumerate(observables) if item.stage == stage and p_values[i] <= level and size[i] > _SMALL
        ]
        if rows:
            best = min(rows, key=lambda i: (p_values[i], -size[i]))
            found.append(_sentence(observables[best], change[best], p_values[best]))
    return tuple(found)


def _sentence(item: Observable, change: float, p_value: float) -> str:
    unit = "" if item.unit == "1" else f" {item.unit}"
    verb = "rises" if change > 0 else "falls"
    return (
        f"{item.stage}: measured less simulated {item.name} {verb} by {abs(change):.2g}{unit} "
        f"from the first run to the last (p = {p_value:.2g})"
    )


def _centred(values: Floats, configuration: NDArray[np.intp]) -> Floats:
    centred = np.array(values, dtype=np.float64)
    for c in np.unique(configuration):
        rows = configuration == c
        known = np.isfinite(centred[rows])
        mean = np.where(known, centred[rows], 0.0).sum(axis=0) / np.maximum(known.sum(axis=0), 1)
        centred[rows] -= mean
    return centred


def _within(configuration: NDArray[np.intp], rng: np.random.Generator) -> NDArray[np.intp]:
    """A permutation of runs that keeps their configurations."""
    shuffled = np.lexsort((rng.random(len(configuration)), configuration))
    found = np.empty(len(configuration), dtype=np.intp)
    found[np.argsort(configuration, kind="stable")] = shuffled
    return found


def _correlation(values: Floats, time: Floats) -> Floats:
    norm = np.linalg.norm(values, axis=0) * np.linalg.norm(time)
    return np.asarray(time @ values / np.maximum(norm, 1e-300))


def _slope(away: Floats, time: Floats) -> Floats:
    known = np.isfinite(away)
    weight = np.maximum((known * time[:, None] ** 2).sum(axis=0), 1e-300)
    return np.asarray(time @ np.nan_to_num(away) / weight)
