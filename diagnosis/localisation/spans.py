"""Stretches of a record, in time or in frequency, in which measurement and simulation differ beyond chance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .means import Floats

FLIPS = 499
#: Shortest stretch that is looked for, in samples.
SHORTEST = 3
#: A stretch ends where the gap falls below this part of its rms.
_EDGE = 0.35


@dataclass(frozen=True, eq=False)
class _Windows:
    """A dyadic bank: all halves, quarters ... of the record, and as many in between. `cover` (W, p) of 0 and 1."""

    cover: Floats

    @classmethod
    def of(cls, samples: int) -> _Windows:
        rows = []
        length = samples
        while length >= min(SHORTEST, samples):
            for start in range(0, samples - length + 1, max(1, length // 2)):
                row = np.zeros(samples)
                row[start : start + length] = 1.0
                rows.append(row)
            length //= 2
        return cls(np.array(rows))


def spans(
    residual: Floats,
    configuration: NDArray[np.intp],
    tolerance: float,
    rng: np.random.Generator,
    level: float = 0.05,
    flips: int = FLIPS,
) -> tuple[tuple[int, int], ...]:
    """First and last sample of each stretch, in order. Residuals (R, p) in the unit of `tolerance`, NaN allowed.

    A window's statistic is the product of residuals of two repetitions, summed over its samples, over pairs and over
    configurations: without a gap its mean is zero whatever the scatter is. Flipping the signs of whole runs says how
    large the largest over all windows gets then (family-wise `level`). The strongest window is taken out and the rest
    searched again, as long as one is beyond chance and its gap beyond the tolerance. Windows that touch are one.
    Where no configuration was repeated chance cannot be told from a gap, and the tolerance alone decides.
    """
    known = np.isfinite(residual)
    values = np.where(known, residual, 0.0)
    member = np.eye(int(configuration.max(initial=-1)) + 1)[:, configuration]
    pairs = ((member @ known) ** 2 - member @ known).sum(axis=0)
    windows = _Windows.of(values.shape[1]).cover
    if not pairs.any():
        return _merged(_strong(np.sqrt(np.mean(values**2, axis=0)), tolerance))
    pairs = np.maximum(pairs, 1.0)
    product = _products(values, member) / pairs
    chance = np.array([_products(values * sign[:, None], member) for sign in _signs(len(values), flips, rng)]) / pairs
    taken = np.zeros(values.shape[1], dtype=bool)
    while (window := _strongest(product, chance, windows, tolerance, level)) is not None:
        taken |= _trimmed(window, product, tolerance)
        windows = windows * ~taken
    return _merged(taken)


def _products(values: Floats, member: Floats) -> Floats:
    """(p,): products of different runs of one configuration, summed."""
    return np.asarray(((member @ values) ** 2).sum(axis=0) - (values**2).sum(axis=0))


def _signs(runs: int, flips: int, rng: np.random.Generator) -> Floats:
    return np.asarray(rng.choice([-1.0, 1.0], size=(flips, runs)))


def _strongest(
    product: Floats, chance: Floats, windows: Floats, tolerance: float, level: float
) -> NDArray[np.bool_] | None:
    """The window (p,) whose statistic is largest beside its scatter by chance."""
    lengths = windows.sum(axis=1)
    windows = windows[lengths >= min(SHORTEST, windows.shape[1])]
    if not len(windows):
        return None
    by_chance = chance @ windows.T
    scatter = np.maximum(by_chance.std(axis=0), 1e-300)
    observed = windows @ product / scatter
    bound = np.quantile((by_chance / scatter).max(axis=1), 1 - level)
    large = windows @ product > tolerance**2 * windows.sum(axis=1)
    observed = np.where(large & (observed > bound), observed, -np.inf)
    best = int(np.argmax(observed))
    return windows[best] > 0 if np.isfinite(observed[best]) else None


def _trimmed(window: NDArray[np.bool_], product: Floats, tolerance: float) -> NDArray[np.bool_]:
    """Without its ends where there is hardly a gap; at least one sample, so that every search takes something out."""
    gap = np.sqrt(np.maximum(product, 0.0))
    least = max(tolerance, _EDGE * float(np.sqrt(np.mean(gap[window] ** 2))))
    inside = np.flatnonzero(window & (gap >= min(least, gap[window].max())))
    trimmed = np.zeros_like(window)
    trimmed[inside[0] : inside[-1] + 1] = True
    return trimmed & window


def _strong(gap: Floats, tolerance: float) -> NDArray[np.bool_]:
    """Samples beyond the tolerance, in stretches that are long enough."""
    wide = np.convolve(gap > tolerance, np.ones(SHORTEST), mode="same") >= SHORTEST
    return np.asarray(np.convolve(wide, np.ones(SHORTEST), mode="same") > 0)


def _merged(taken: NDArray[np.bool_]) -> tuple[tuple[int, int], ...]:
    edges = np.flatnonzero(np.diff(np.concatenate(([False], taken, [False])).astype(int)))
    return tuple((int(a), int(b) - 1) for a, b in zip(edges[::2], edges[1::2], strict=True))
