"""How well runs fill the space, and how well a model of main effects can be fitted to them.

How evenly runs fill the cells of one, two or three axes. Depends on no order of the levels.

Glossary: a cell is a level of each of some axes; its share is the number of runs over the number of
such cells.

Where the levels of an axis lie between 0 and 1, for measures that need a place.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats, Levels
from ..space import Axis, Space


def cell_counts(treatments: Levels, sizes: Sequence[int], axes: Sequence[int]) -> Levels:
    """Runs in each cell of some axes, an array with one dimension per axis.

    Parameters:
        treatments: Level indices of the runs, of shape `(n, all axes)`.
        sizes: The number of levels of each axis.
        axes: Indices of the axes whose cells are counted.
    """
    shape = tuple(sizes[axis] for axis in axes)
    flat = np.ravel_multi_index(tuple(treatments[:, axis] for axis in axes), shape)
    return np.bincount(flat, minlength=int(np.prod(shape))).reshape(shape)


def deviations(
    treatments: Levels, sizes: Sequence[int], order: int
) -> Iterator[tuple[tuple[int, ...], Floats]]:
    """For every set of `order` axes: the set, and count minus share in each of its cells.

    Parameters:
        treatments: Level indices of the runs, of shape `(n, axes)`.
        sizes: The number of levels of each axis.
        order: The number of axes of a cell: 1 for levels, 2 for pairs, 3 for triples.

    Returns:
        Indices of the axes, and an array in runs with one dimension per axis of the set.
    """
    for axes in itertools.combinations(range(len(sizes)), order):
        counts = cell_counts(treatments, sizes, axes)
        yield axes, np.asarray(counts - len(treatments) / counts.size, dtype=np.float64)


def worst_deviation(treatments: Levels, sizes: Sequence[int], order: int) -> float:
    """The largest distance of a cell's count from its share, in runs; 0 where there are too few
    axes.

    Parameters:
        treatments: Level indices of the runs, of shape `(n, axes)`.
        sizes: The number of levels of each axis.
        order: The number of axes of a cell: 1 for levels, 2 for pairs, 3 for triples.
    """
    return max(
        (float(np.abs(deviation).max()) for _, deviation in deviations(treatments, sizes, order)),
        default=0.0,
    )


def rms_deviation(treatments: Levels, sizes: Sequence[int], order: int) -> float:
    """Root mean square of count minus share over the cells of all sets of axes; 0 where there are
    too few axes.

    Parameters:
        treatments: Level indices of the runs, of shape `(n, axes)`.
        sizes: The number of levels of each axis.
        order: The number of axes of a cell: 1 for levels, 2 for pairs, 3 for triples.
    """
    parts = [deviation.ravel() for _, deviation in deviations(treatments, sizes, order)]
    return float(np.sqrt(np.mean(np.concatenate(parts) ** 2))) if parts else 0.0


def beyond_one(treatments: Levels, sizes: Sequence[int], order: int) -> int:
    """Cells whose count is a whole run or more from its share: 0 is as even as whole runs can be.

    Parameters:
        treatments: Level indices of the runs, of shape `(n, axes)`.
        sizes: The number of levels of each axis.
        order: The number of axes of a cell: 1 for levels, 2 for pairs, 3 for triples.
    """
    return sum(
        int((np.abs(deviation) > 1 - 1e-9).sum())
        for _, deviation in deviations(treatments, sizes, order)
    )


def distinct(treatments: Levels) -> int:
    """Number of different treatments.

    Parameters:
        treatments: Level indices of the runs, of shape `(n, axes)`.
    """
    return len(np.unique(treatments, axis=0))


def discrepancy(points: Floats, kind: str) -> float:
    """Squared L2 discrepancy of points in the unit cube. It depends on the order of the levels.

    Parameters:
        points: Places in the unit cube, of shape `(n, axes)`, as `centres` gives them.
        kind: "CD" for the centred, "WD" for the wrap-around discrepancy.

    Raises:
        ValueError: For another kind.

    Source:
        Hickernell, Math. Comp. 67, 1998, as scipy.stats.qmc gives it.
    """
    from scipy.stats import qmc

    if kind not in ("CD", "WD"):
        raise ValueError(f"kind is {kind!r}; expected CD or WD")
    return float(qmc.discrepancy(points, method="CD" if kind == "CD" else "WD"))


def minimum_distance(points: Floats) -> float:
    """Euclidean distance of the two nearest points; infinite for a single one.

    Parameters:
        points: Places in the unit cube, of shape `(n, axes)`, as `centres` gives them.
    """
    from scipy.spatial.distance import pdist

    return float(pdist(points).min()) if len(points) > 1 else float("inf")


def fewest_differences(treatments: Levels) -> int:
    """Number of axes in which the two most similar treatments differ; all axes for a single one.

    Parameters:
        treatments: Level indices of the runs, of shape `(n, axes)`.
    """
    from scipy.spatial.distance import pdist

    axes = int(treatments.shape[1])
    return round(float(pdist(treatments, "hamming").min()) * axes) if len(treatments) > 1 else axes


def largest_correlation(treatments: Levels, sizes: Sequence[int]) -> float:
    """The largest canonical correlation between two axes: 0 for orthogonal ones, 1 for confounded
    ones.

    It is the largest Pearson correlation that any scores for the levels of both axes can give, so
    that it needs no order of the levels; between axes of two levels it is Pearson's.

    Parameters:
        treatments: Level indices of the runs, of shape `(n, axes)`.
        sizes: The number of levels of each axis.

    Source:
        Hirschfeld 1935.
    """
    pairs = itertools.combinations(range(len(sizes)), 2)
    return max((_canonical(cell_counts(treatments, sizes, pair)) for pair in pairs), default=0.0)


def _canonical(counts: Levels) -> float:
    used = counts[np.ix_(counts.sum(axis=1) > 0, counts.sum(axis=0) > 0)].astype(np.float64)
    rows, columns = used.sum(axis=1), used.sum(axis=0)
    independent = np.outer(rows, columns) / used.sum()
    standardised = (used - independent) / np.sqrt(np.outer(rows, columns))
    return min(1.0, float(np.linalg.svd(standardised, compute_uv=False)[0]))


def main_effects(treatments: Levels, sizes: Sequence[int], linear: Sequence[int] = ()) -> Floats:
    """Model matrix `(n, 1 + sum of (levels - 1))`: a constant and main effects in effect coding.

    A level has a column of its own (1), and -1 in all columns of its axis for the last level.

    Parameters:
        treatments: Level indices of the runs, of shape `(n, axes)`.
        sizes: The number of levels of each axis.
        linear: Indices of the axes that have one column instead, from -1 at the first level to 1 at
            the last; by default none.
    """
    columns = [np.ones((len(treatments), 1))]
    for axis, size in enumerate(sizes):
        coding = np.vstack([np.eye(size - 1), -np.ones((1, size - 1))])
        if axis in linear:
            coding = np.linspace(-1.0, 1.0, size)[:, None]
        columns.append(coding[treatments[:, axis]])
    return np.hstack(columns)


def d_efficiency(treatments: Levels, sizes: Sequence[int], linear: Sequence[int] = ()) -> float:
    """`|X'X / n|^(1/p)` of `main_effects`; 0 where they cannot be estimated.

    With effect coding a balanced orthogonal design has `d_efficiency_limit`, not 1.

    Parameters:
        treatments: Level indices of the runs, of shape `(n, axes)`.
        sizes: The number of levels of each axis.
        linear: Indices of the axes that have a linear effect only; by default none.

    Source:
        Montgomery, section 11.4.
    """
    x = main_effects(treatments, sizes, linear)
    sign, log_determinant = np.linalg.slogdet(x.T @ x / len(x))
    if sign <= 0 or np.linalg.matrix_rank(x) < x.shape[1]:
        return 0.0
    return float(np.exp(log_determinant / x.shape[1]))


def d_efficiency_limit(sizes: Sequence[int], linear: Sequence[int] = ()) -> float:
    """`d_efficiency` of a balanced orthogonal design: an axis of k levels has `|X'X / n| = k^(2 -
    k)`.

    Parameters:
        sizes: The number of levels of each axis.
        linear: Indices of the axes that have a linear effect only; by default none. Such an axis,
            whose runs all stand at its ends, has 1, as one of two levels.
    """
    counts = [2 if axis in linear else size for axis, size in enumerate(sizes)]
    parameters = 1 + sum(size - 1 for size in counts)
    return float(np.exp(sum((2 - size) * np.log(size) for size in counts) / parameters))


def axis_centres(space: Space) -> list[Floats]:
    """Per axis, the centre of each level's cell, `(levels,)`: the range cut into as many equal
    cells as levels.

    Discrepancies depend on the order of the levels, which combinations of factors do not have by
    nature. They stand here in the order of their last factor, then of the one before: none,
    aluminum, steel without insulator, then aluminum, steel with it. In this order Table A.1 has the
    discrepancies that are quoted for it.

    Parameters:
        space: What the campaign varies.
    """
    return [(_ranks(axis) + 0.5) / axis.size for axis in space.axes]


def centres(space: Space, treatments: NDArray[np.int64]) -> Floats:
    """Points `(n, axes)` in the unit cube, at the centres of the levels of treatments.

    Parameters:
        space: What the campaign varies.
        treatments: Treatments of the space, of shape `(n, axes)`.
    """
    return np.stack(
        [places[treatments[:, axis]] for axis, places in enumerate(axis_centres(space))], axis=1
    )


def _ranks(axis: Axis) -> NDArray[np.int64]:
    order = sorted(range(axis.size), key=lambda index: axis.combinations[index][::-1])
    return np.argsort(order).astype(np.int64)
