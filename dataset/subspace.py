"""Leverage: how far a combination of predictors lies from all that were recorded, though each value may lie inside.

Predictors of one campaign are collinear (three tips have five properties), so the covariance is singular: leverage is
taken in the subspace that the training rows span, and what lies off it is judged by its distance.

Glossary: z (n x p) are numbers in standard deviations and categories as one column per level, centred and scaled;
h = |z V / S|^2 is the leverage of a row (z = U S V^T for the training rows), e = z - z V V^T what lies off the
subspace.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from ..array_types import Floats

#: Singular values below this share of the largest are round-off.
_RANK_SHARE = 1e-6
#: Distance off the subspace, in standard deviations, that is still a matter of digits.
OFF_LIMIT = 0.05


@dataclass(frozen=True, eq=False)
class Distances:
    """Of n rows: leverage and distance off the subspace as multiples of what is allowed, and each column's share
    (n x p) of the larger one."""

    leverage: Floats
    off: Floats
    shares: Floats


@dataclass(frozen=True, eq=False)
class Subspace:
    """Where the training rows lie: `mean` and `scale` (p,), `axes` (r x p) whose rows are V^T / S, their largest
    leverage and their largest distance off the subspace."""

    mean: Floats
    scale: Floats
    axes: Floats
    spread: Floats
    leverage_limit: float
    off_limit: float

    @classmethod
    def of(cls, encoded: Floats) -> Self:
        """Of training rows (n x p)."""
        mean, scale = encoded.mean(axis=0), encoded.std(axis=0)
        scale = np.where(scale > 1e-12 * np.abs(encoded).max(axis=0, initial=0.0), scale, 1.0)
        _, spread, axes = np.linalg.svd((encoded - mean) / scale, full_matrices=False)
        kept = spread > _RANK_SHARE * spread.max(initial=0.0)
        subspace = cls(mean, scale, axes[kept], spread[kept], 1.0, 1.0)
        distances = subspace.distances(encoded)
        # A little above the largest, for other machines round otherwise.
        leverage = float(distances.leverage.max(initial=0.0)) * (1 + 1e-6) or 1.0
        off = max(OFF_LIMIT, 2 * float(distances.off.max(initial=0.0)))
        return cls(mean, scale, axes[kept], spread[kept], leverage, off)

    def distances(self, encoded: Floats) -> Distances:
        """Of rows (n x p); above 1 is outside."""
        z = (encoded - self.mean) / self.scale
        scores = z @ self.axes.T
        off = z - scores @ self.axes
        weighted = scores / self.spread
        leverage = (weighted**2).sum(axis=1) / self.leverage_limit
        distance = np.sqrt((off**2).sum(axis=1)) / self.off_limit
        # h = z (P z) and |e|^2 = e e, column by column.
        by_leverage = z * ((weighted / self.spread) @ self.axes)
        shares = np.where((distance > 1)[:, None], off**2, by_leverage)
        return Distances(leverage, distance, shares)

    def as_json(self) -> dict[str, Any]:
        """What `from_json` reads back."""
        arrays = {name: getattr(self, name).tolist() for name in ("mean", "scale", "axes", "spread")}
        return {**arrays, "leverage_limit": self.leverage_limit, "off_limit": self.off_limit}

    @classmethod
    def from_json(cls, data: dict[str, Any]) -> Self:
        """Raises `KeyError`, `TypeError` or `ValueError` for other data."""
        mean, scale, spread = (np.array(data[name], dtype=np.float64) for name in ("mean", "scale", "spread"))
        axes = np.array(data["axes"], dtype=np.float64).reshape(spread.size, mean.size)
        return cls(mean, scale, axes, spread, float(data["leverage_limit"]), float(data["off_limit"]))
