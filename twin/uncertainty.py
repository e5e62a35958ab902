"""What draws say: a mean, and between what 90 % of them lie."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from ..array_types import Floats

#: Ends of a 90 % band.
LOW, HIGH = 0.05, 0.95


@dataclass(frozen=True)
class Quantity:
    """A number with the 5 and the 95 % quantile of its draws, in the unit that its name bears."""

    mean: float
    ci90: tuple[float, float]

    @classmethod
    def of(cls, draws: Floats) -> Self:
        """From draws (d,)."""
        low, high = _ends(draws)
        return cls(float(draws.mean()), (float(low), float(high)))

    def as_json(self) -> dict[str, Any]:
        return {"mean": self.mean, "ci90": list(self.ci90)}


@dataclass(frozen=True, eq=False)
class Band:
    """A series (n,) with the 5 and the 95 % quantile of its draws at each point alone."""

    mean: Floats
    lower: Floats
    upper: Floats

    @classmethod
    def of(cls, draws: Floats) -> Self:
        """From draws (d, n)."""
        lower, upper = _ends(draws)
        return cls(draws.mean(axis=0), lower, upper)

    def as_json(self) -> dict[str, Any]:
        return {"mean": self.mean.tolist(), "lower": self.lower.tolist(), "upper": self.upper.tolist()}


def _ends(draws: Floats) -> Floats:
    """Quantiles (2, ...) over the first axis; Hazen's, at which mid-quantiles of strata stand."""
    return np.asarray(np.quantile(draws, (LOW, HIGH), axis=0, method="hazen"))


def stratified_normals(count: int, columns: int, rng: np.random.Generator) -> Floats:
    """Standard normal numbers (count, columns), each column the mid-quantiles of `count` equal strata, shuffled.

    Means and quantiles of 64 such draws scatter less than those of 64 independent ones; a Latin hypercube: McKay,
    Beckman and Conover, Technometrics 21 (1979) 239.
    """
    from scipy.special import ndtri

    strata = np.tile(ndtri((np.arange(count) + 0.5) / count)[:, None], (1, columns))
    return np.asarray(rng.permuted(strata, axis=0))
