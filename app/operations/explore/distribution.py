"""How the values of a quantity are distributed: quantiles, and the cells of a histogram."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from ....array_types import Floats

#: Cells of a histogram: fewer hide the shape, more show chance.
FEWEST_CELLS, MOST_CELLS = 8, 80


@dataclass(frozen=True)
class ValueSummary:
    """Of the values of a group: how many, mean, standard deviation (NaN of a single one), smallest,
    largest, and the quantiles between."""

    group: str
    count: int
    mean: float
    deviation: float
    minimum: float
    q05: float
    q25: float
    median: float
    q75: float
    q95: float
    maximum: float

    def as_row(self) -> dict[str, Any]:
        """The same as plain data."""
        return asdict(self)


def summary_of(group: str, values: Floats) -> ValueSummary:
    """The summary of finite values (n,), n >= 1. Quantiles lie linearly between neighbours (type 7
    of Hyndman and Fan, as NumPy has it)."""
    q05, q25, median, q75, q95 = map(float, np.quantile(values, [0.05, 0.25, 0.5, 0.75, 0.95]))
    return ValueSummary(
        group,
        count=values.size,
        mean=float(values.mean()),
        deviation=float(values.std(ddof=1)) if values.size > 1 else float("nan"),
        minimum=float(values.min()),
        q05=q05,
        q25=q25,
        median=median,
        q75=q75,
        q95=q95,
        maximum=float(values.max()),
    )


def histogram_edges(values: Floats, *, logarithmic: bool = False) -> Floats:
    """The edges (k + 1,) of equal cells about finite values (n,), n >= 1: as wide as the rule of
    Freedman and Diaconis (1981) has it, but not fewer than `FEWEST_CELLS` and not more than
    `MOST_CELLS`.

    Parameters:
        values: The values; on a logarithmic axis all are positive.
        logarithmic: Whether the cells are equal on a logarithmic axis.
    """
    scaled = np.log10(values) if logarithmic else values
    low, high = float(scaled.min()), float(scaled.max())
    if high - low <= 1e-9 * max(abs(low), abs(high)):  # one value: a cell about it
        room = abs(low) / 2 or 0.5
        edges = np.array([low - room, low + room])
    else:
        first, third = np.quantile(scaled, [0.25, 0.75])
        width = 2 * (third - first) / np.cbrt(scaled.size)
        wanted = int(np.ceil((high - low) / width)) if width > 0 else MOST_CELLS
        edges = np.linspace(low, high, min(MOST_CELLS, max(FEWEST_CELLS, wanted)) + 1)
    if not logarithmic:
        return edges
    powers: Floats = 10.0**edges
    powers[0], powers[-1] = min(powers[0], values.min()), max(powers[-1], values.max())
    return powers
