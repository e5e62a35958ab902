"""What makes one set of treatments better than another: a sum over all pairs of runs.

Glossary: a run is a row of levels, one per axis; two runs agree on an axis where their levels are
the same; e_k is the number of sets of k axes on which two runs agree.

Summed over all pairs of runs, e_k is the sum of squared counts over all cells of all sets of k
axes: least where every cell holds its share. That is the discrete discrepancy of Hickernell and Liu
("Uniform designs limit aliasing", Biometrika 89, 2002) order by order, so that pairs may weigh more
than triples. Centred and wrap-around discrepancy (Hickernell, Math. Comp. 67, 1998) are sums over
pairs of runs too; all terms add up to one table of numbers.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...array_types import Floats, Levels


@dataclass(frozen=True)
class Weights:
    """Weight of a squared count, by the number of axes of its cell, and of the discrepancies times
    n squared.

    One count moved between cells of pairs outweighs several of triples; the rest decides between
    equals. `repeat` is for agreement on all axes, `neighbour` for all but one (where that is no
    pair or triple already).
    """

    pair: float = 1.5
    triple: float = 1.0
    quadruple: float = 0.02
    neighbour: float = 0.1
    repeat: float = 10.0
    centred: float = 0.05
    wrap_around: float = 0.05

    def by_order(self, axes: int) -> Floats:
        """(axes + 1,): the weight of e_k at k."""
        result = np.zeros(axes + 1)
        for order, weight in ((2, self.pair), (3, self.triple), (4, self.quadruple)):
            if order <= axes:
                result[order] = weight
        if axes > 4:
            result[axes - 1] += self.neighbour
        result[axes] += self.repeat
        return result


class Kernel:
    """The criterion of designs of `runs` runs: the sum of `between` over all ordered pairs, and of
    `alone` over all.

    `centres` holds, per axis, the place of each level in (0, 1), for the discrepancies.
    """

    def __init__(self, centres: Sequence[Floats], runs: int, weights: Weights) -> None:
        self._orders = weights.by_order(len(centres))
        self._centred, self._wrap_around, self._runs = weights.centred, weights.wrap_around, runs
        self._pairs = [_centred_pairs(places) for places in centres]
        self._singles = [
            1 + np.abs(places - 0.5) / 2 - (places - 0.5) ** 2 / 2 for places in centres
        ]
        self._wraps = [_wrap_around_pairs(places) for places in centres]

    def between(self, x: Levels, y: Levels) -> Floats:
        """Of runs x (..., axes) and y (..., axes), broadcasting."""
        shape = np.broadcast_shapes(x.shape, y.shape)[:-1]
        agreeing = [np.ones(shape), *(np.zeros(shape) for _ in self._pairs)]
        centred, wrap_around = np.full(shape, self._centred), np.full(shape, self._wrap_around)
        for axis, (pairs, wraps) in enumerate(zip(self._pairs, self._wraps, strict=True)):
            a, b = x[..., axis], y[..., axis]
            same = a == b
            for order in range(axis + 1, 0, -1):  # elementary symmetric sums, one axis more
                agreeing[order] += same * agreeing[order - 1]
            centred *= pairs[a, b]
            wrap_around *= wraps[a, b]
        return np.asarray(
            sum(
                (w * e for w, e in zip(self._orders, agreeing, strict=True) if w),
                centred + wrap_around,
            )
        )

    def alone(self, x: Levels) -> Floats:
        """Of runs x (..., axes): the centred discrepancy's single sum."""
        result = np.full(x.shape[:-1], -2.0 * self._runs * self._centred)
        for axis, singles in enumerate(self._singles):
            result *= singles[x[..., axis]]
        return result


def _centred_pairs(places: Floats) -> Floats:
    z = np.abs(places - 0.5)
    return np.asarray(1 + (z[:, None] + z - np.abs(places[:, None] - places)) / 2)


def _wrap_around_pairs(places: Floats) -> Floats:
    apart = np.abs(places[:, None] - places)
    return np.asarray(1.5 - apart * (1 - apart))


def least_squares(runs: int, sizes: Sequence[int], order: int) -> int:
    """The sum of squared counts over all cells of `order` axes where each holds its share, rounded
    up or down."""
    total = 0
    for chosen in itertools.combinations(sizes, order):
        cells = int(np.prod(chosen))
        share, more = divmod(runs, cells)
        total += more * (share + 1) ** 2 + (cells - more) * share**2
    return total
