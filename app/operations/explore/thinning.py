"""Many points as few marks, of which none hides an outlier.

A scatter is divided into cells. Points that are alone in their cell, or in small company, are drawn
one by one, and so are the extremes of every group on both axes; what is left of a cell is one mark
at the mean place of its points, which says how many they are. A line keeps the smallest and the
largest value of each stretch.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ....array_types import Floats

#: Points up to which all are drawn; of more about `MOST_SINGLE` are drawn one by one, the others
#: in cells, of which a scatter has so many across and up.
MOST_POINTS, MOST_SINGLE = 4_000, 1_500
CELLS = (64, 44)

Places = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class DenseCells:
    """Cells with several points of one group (k,): the group, the mean place of the points in
    coordinates of the axes, and how many they are."""

    group: Places
    x: Floats
    y: Floats
    count: Places


@dataclass(frozen=True, eq=False)
class ThinnedScatter:
    """`points` (m,) are the places of the points that are drawn one by one, `cells` hold all
    others."""

    points: Places
    cells: DenseCells


def thin_scatter(x: Floats, y: Floats, group: Places, most: int = MOST_POINTS) -> ThinnedScatter:
    """Finite points x, y (n,) of groups (n,), as few marks.

    Parameters:
        x: Coordinates on the axis, which are logarithms where that is logarithmic.
        y: The same of the other axis.
        group: The number of each point's group, from 0 on.
        most: The number of points up to which all are drawn.
    """
    if x.size <= most:
        none = np.zeros(0)
        whole = np.zeros(0, dtype=np.intp)
        return ThinnedScatter(np.arange(x.size), DenseCells(whole, none, none, whole))
    across, up = CELLS
    cell = _cell(x, across) * up + _cell(y, up)
    key = group * (across * up) + cell
    counts = np.bincount(key)
    drawn = counts[key] <= _company(counts, min(most, MOST_SINGLE))
    drawn[_extremes(x, y, group)] = True
    rest = ~drawn
    rest_counts = np.bincount(key[rest], minlength=counts.size)
    filled = np.flatnonzero(rest_counts)
    means = [
        np.bincount(key[rest], weights=values[rest], minlength=counts.size)[filled]
        / rest_counts[filled]
        for values in (x, y)
    ]
    cells = DenseCells(filled // (across * up), means[0], means[1], rest_counts[filled])
    return ThinnedScatter(np.flatnonzero(drawn), cells)


def _cell(values: Floats, count: int) -> Places:
    low, high = float(values.min()), float(values.max())
    if high <= low:
        return np.zeros(values.size, dtype=np.intp)
    share = (values - low) / (high - low)
    return np.minimum((share * count).astype(np.intp), count - 1)


def _company(counts: Places, most: int) -> int:
    """The largest number of points of a cell that are drawn one by one, so that they are `most` in
    all; 1 at least, for a point that is alone is never left out."""
    by_count = np.bincount(counts)
    drawn = np.cumsum(by_count * np.arange(by_count.size))
    return max(1, int(np.searchsorted(drawn, most, "right")) - 1)


def _extremes(x: Floats, y: Floats, group: Places) -> list[int]:
    """Places of the smallest and the largest values of each group on both axes."""
    places: list[int] = []
    for number in np.unique(group):
        own = np.flatnonzero(group == number)
        for values in (x[own], y[own]):
            places += [int(own[values.argmin()]), int(own[values.argmax()])]
    return places


def thin_line(values: Floats, most: int = MOST_POINTS) -> Places:
    """Places of finite values (n,) that a line is drawn through: all of up to `most`, else the
    smallest and the largest value of each of `most` / 2 stretches."""
    if values.size <= most:
        return np.arange(values.size)
    edges = np.linspace(0, values.size, most // 2 + 1).astype(np.intp)
    places = {0, values.size - 1}
    for first, last in pairwise(edges.tolist()):
        stretch = values[first:last]
        places |= {int(first + stretch.argmin()), int(first + stretch.argmax())}
    return np.array(sorted(places), dtype=np.intp)


def thin_outliers(values: Floats, most: int = MOST_POINTS) -> Places:
    """Places of finite values (n,), all of up to `most`, else those that lie furthest from the
    median."""
    if values.size <= most:
        return np.arange(values.size)
    distance = np.abs(values - np.median(values))
    return np.sort(np.argpartition(distance, -most)[-most:])
