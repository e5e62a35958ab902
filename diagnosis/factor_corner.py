"""The corner of the factor space where an extrapolation has the most to lose."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..array_types import Floats, Rows
from ..doe.factor_rules import short_between
from ..schema.known_factors import column_of

#: The part of the configurations that makes a corner, and the part beyond which it is cut down by
#: another factor.
_CORNER, _LARGE = 0.25, 0.4
#: Configurations on either side.
_LEAST = 3


@dataclass(frozen=True, eq=False)
class FactorCorner:
    """`rows`: the configurations in a corner, in rising order; `rule` says which these are."""

    rule: str
    rows: Rows


def corner_of_factors(
    factors: Sequence[Mapping[str, str | float]], size: Floats
) -> FactorCorner | None:
    """About a quarter of the configurations, at one end of the numeric factor that the gap goes
    with most.

    `factors` of n configurations; `size` (n,) is how large the gap of each is. The end is the one
    with the larger gap. Where that end is far more than a quarter (a factor of two levels) it is
    taken together with the end of the next factor. None where no number varies, or too few
    configurations would be left.
    """
    ends = []
    for name in dict.fromkeys(name for row in factors for name in row):
        values = [row.get(name) for row in factors]
        if all(isinstance(value, int | float) for value in values) and len(set(values)) > 1:
            ends.append(_end(name, np.array(values, dtype=np.float64), size))
    texts: list[str] = []
    inside = np.ones(len(factors), dtype=bool)
    for text, part, _ in sorted(ends, key=lambda end: -end[2]):
        if not texts or (np.mean(inside) > _LARGE and (inside & part).sum() >= _LEAST):
            texts.append(text)
            inside &= part
    if not _LEAST <= inside.sum() <= min(len(factors) // 2, len(factors) - _LEAST):
        return None
    return FactorCorner(" and ".join(texts), np.flatnonzero(inside))


def _end(name: str, values: Floats, size: Floats) -> tuple[str, NDArray[np.bool_], float]:
    """One end of a factor as a rule, the configurations in it, and how closely the gap goes with
    the factor."""
    from scipy.stats import spearmanr

    levels = np.unique(values)
    correlation = spearmanr(values, size).statistic if np.ptp(size) > 0 else 0.0
    above = [values > level for level in levels[:-1]]
    candidates = above if correlation >= 0 else [~part for part in above]
    nearest = int(np.argmin([abs(np.mean(part) - _CORNER) for part in candidates]))
    column, unit = column_of(name)
    edge = short_between(levels[nearest] / unit, levels[nearest + 1] / unit)
    return (
        f"{column} {'>' if correlation >= 0 else '<='} {edge:g}",
        candidates[nearest],
        abs(float(correlation)),
    )
