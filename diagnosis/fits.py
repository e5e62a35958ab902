"""Parameters of a hypothesis with their intervals."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .evidence.pairs import OnPair
from .evidence.singles import OnSurface
from .evidence.weighing import Weighed
from .verdict import Fitted

Floats = NDArray[np.float64]

_Z90 = 1.6449


def fitted_parameters(weighed: Weighed, name: str) -> tuple[Fitted, ...]:
    """Of an effect or a pair: the likeliest value, and the central 90 % of the posterior (of a pair: by its width)."""
    if name in weighed.pairs:
        return _of_pair(weighed, weighed.pairs[name])
    if name not in weighed.singles:
        return ()
    return _of_single(weighed.best_sheet(name))


def _of_single(sheet: OnSurface) -> tuple[Fitted, ...]:
    weight = np.exp(sheet.log_posterior)
    point, _ = sheet.best
    found = []
    for i, axis in enumerate(sheet.surface.sheet.axes):
        place = sheet.surface.points[:, i]
        low, high = _quantiles(place, weight, (0.05, 0.95))
        ends = sorted((float(axis.value(np.array(low))), float(axis.value(np.array(high)))))
        value = float(axis.value(place[point]))
        found.append(Fitted(axis.name, value, axis.unit, (min(ends[0], value), max(ends[1], value))))
    return tuple(found)


def _of_pair(weighed: Weighed, pair: OnPair) -> tuple[Fitted, ...]:
    found = []
    for index, u, width in zip((pair.first, pair.second), pair.u, pair.width, strict=True):
        surface = weighed.scene.surfaces[index]
        for axis, place, sigma in zip(surface.sheet.axes, u, width, strict=True):
            ends = axis.value(np.clip(np.array([place - _Z90 * sigma, place, place + _Z90 * sigma]), 0.0, 1.0))
            name = f"{surface.id}.{axis.name}"
            found.append(Fitted(name, float(ends[1]), axis.unit, (float(ends.min()), float(ends.max()))))
    return tuple(found)


def _quantiles(place: Floats, weight: Floats, shares: tuple[float, float]) -> tuple[float, float]:
    """Of a posterior on a grid, linear between its places."""
    values, at = np.unique(place, return_inverse=True)
    mass = np.bincount(at, weights=weight)
    share = (np.cumsum(mass) - 0.5 * mass) / mass.sum()
    low, high = np.interp(shares, share, values)
    return float(low), float(high)
