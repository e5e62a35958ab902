"""In which stage the gap arises."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from ..observables.base import Stage
from ..verdict import StageShare
from .interfaces import Chain, Link, chain_of, notes_of
from .means import Floats, Means, floors, tolerances
from .shapley import shapley

RESAMPLES = 2000


@dataclass(frozen=True, eq=False)
class Squares:
    """Squared gaps (C,) of each configuration, in tolerances, the noise taken off: of links (S, C)."""

    worth: Floats
    own: Floats

    @classmethod
    def of(cls, chain: Chain) -> Self:
        weight = 1.0 / len(chain.links)
        worth = np.sum([weight * _worth(link, chain) for link in chain.links], axis=0)
        return cls(np.asarray(worth), np.array([_own(link, chain) for link in chain.links]))


def stage_shares(
    stages: Sequence[Stage], rng: np.random.Generator, resamples: int = RESAMPLES
) -> tuple[StageShare, ...]:
    """The stages by falling own gap: the first is where the cause acts.

    `own` is what decides, since a stage that is given its measured entrance cannot be blamed for another's cause: the
    rms of its mean residuals over configurations and observables, in tolerances, scatter of the repetitions taken off.
    `share` is of the gap that the chain shows when it runs freely from its entrance: the loss is the squared gap in
    tolerances at every measured exit (each exit counts the same, the scatter taken off), and exact Shapley values share
    it among the stages that get replaced by what was measured. The exits on the way count beside the last one because
    errors that cancel at the end (a gain of the sensor between two stages) would otherwise be nobody's.
    Shares are clipped at zero and sum to one. The intervals resample configurations; (0, 1) where there are not two.
    """
    chain = chain_of(stages)
    squares = Squares.of(chain)
    share = _shares(squares.worth.sum(axis=1)[:, None], squares.own.sum(axis=1)[:, None])[:, 0]
    low, high = _interval(squares, rng, resamples)
    own = np.sqrt(np.maximum(np.nanmean(squares.own, axis=1), 0.0))
    found = [
        StageShare(
            link.name, float(share[i]), (float(min(low[i], share[i])), float(max(high[i], share[i]))), float(own[i])
        )
        for i, link in enumerate(chain.links)
    ]
    return tuple(sorted(found, key=lambda each: (each.own, each.share), reverse=True))


def stage_notes(stages: Sequence[Stage]) -> tuple[str, ...]:
    """Sentences on stages that could not be told apart. Raises as `chain_of`."""
    return notes_of(stages)


def _worth(link: Link, chain: Chain) -> Floats:
    """(S, C): Shapley values of the squared gap at one exit.

    Errors of the velocity at an entrance stand in two parts with opposite signs and not in their sum: they average out
    of Shapley values. The scatter at the exit stands in the last part alone.
    """
    last = chain.links.index(link)

    def loss(replaced: frozenset[int]) -> Floats:
        left = [i for i in range(len(link.parts)) if i not in replaced]
        values = link.parts[left].sum(axis=0)
        floor = floors(link.observables) if last in left else 0.0
        return -_square(values, link, chain, floor)

    return shapley(loss, len(link.parts))


def _own(link: Link, chain: Chain) -> Floats:
    """(C,)"""
    return _square(link.own, link, chain, np.sqrt(np.mean(link.floor**2, axis=0)))


def _square(values: Floats, link: Link, chain: Chain, floor: Floats | float) -> Floats:
    means = Means.of(values, chain.configuration, chain.configurations, floor)
    square = (means.mean**2 - means.variance) / tolerances(link.observables) ** 2
    known = np.isfinite(square)
    return np.asarray(np.where(known, square, 0.0).sum(axis=1) / np.maximum(known.sum(axis=1), 1))


def _shares(worth: Floats, own: Floats) -> Floats:
    """(S, B) from sums over configurations. Where the chain has no gap left by the scatter, own gaps are shared."""
    gains, alone = np.maximum(worth, 0.0), np.maximum(own, 0.0)
    gains = np.where(gains.sum(axis=0) > 0, gains, np.where(alone.sum(axis=0) > 0, alone, 1.0))
    return np.asarray(gains / gains.sum(axis=0))


def _interval(squares: Squares, rng: np.random.Generator, resamples: int) -> tuple[Floats, Floats]:
    """Low and high (S,) of 90 %, whole configurations drawn with replacement."""
    links, cells = squares.worth.shape
    if cells < 2:
        return np.zeros(links), np.ones(links)
    drawn = rng.multinomial(cells, np.full(cells, 1 / cells), size=resamples).T.astype(np.float64)
    low, high = np.quantile(_shares(squares.worth @ drawn, squares.own @ drawn), [0.05, 0.95], axis=1)
    return np.asarray(low), np.asarray(high)
