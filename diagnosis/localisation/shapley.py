"""Exact Shapley values over the few stages of a bench."""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations
from math import factorial

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def shapley(value: Callable[[frozenset[int]], Floats], players: int) -> Floats:
    """(players, ...): each one's mean gain over all orders of joining; `value` of every one of the 2^S coalitions.

    Shapley, A value for n-person games, Annals of Mathematics Studies 28 (1953) 307.
    """
    known = {
        frozenset(each): value(frozenset(each)) for n in range(players + 1) for each in combinations(range(players), n)
    }
    worth = []
    for player in range(players):
        others = [each for each in known if player not in each]
        gains = [_weight(len(each), players) * (known[each | {player}] - known[each]) for each in others]
        worth.append(np.sum(gains, axis=0))
    return np.asarray(worth)


def _weight(joined: int, players: int) -> float:
    return factorial(joined) * factorial(players - joined - 1) / factorial(players)
