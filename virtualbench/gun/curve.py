"""Position over time between the points of a shot: cubics that have its positions and velocities (Hermite)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats


def position_at(time_s: Floats, position_m: Floats, velocity_m_s: Floats, moment_s: Floats) -> Floats:
    """Position (k,) at moments (k,), from points (n,); before the first and after the last it stays where it is."""
    k, step, share = _place(time_s, moment_s)
    rest = 1 - share
    ends = rest**2 * (1 + 2 * share) * position_m[k] + share**2 * (3 - 2 * share) * position_m[k + 1]
    return np.asarray(ends + share * rest * step * (rest * velocity_m_s[k] - share * velocity_m_s[k + 1]))


def velocity_at(time_s: Floats, position_m: Floats, velocity_m_s: Floats, moment_s: Floats) -> Floats:
    """The slope of `position_at` (k,)."""
    k, step, share = _place(time_s, moment_s)
    rest = 1 - share
    chord = 6 * share * rest * (position_m[k + 1] - position_m[k]) / step
    return np.asarray(chord + rest * (1 - 3 * share) * velocity_m_s[k] + share * (3 * share - 2) * velocity_m_s[k + 1])


def _place(time_s: Floats, moment_s: Floats) -> tuple[NDArray[np.intp], Floats, Floats]:
    """The step in which each moment lies, its length, and the share of it that has gone."""
    moment = np.clip(moment_s, time_s[0], time_s[-1])
    k = np.clip(np.searchsorted(time_s, moment, side="right") - 1, 0, time_s.size - 2)
    step = time_s[k + 1] - time_s[k]
    return k, step, (moment - time_s[k]) / step


def crossings(time_s: Floats, position_m: Floats, velocity_m_s: Floats, level_m: float) -> Floats:
    """Moments (k,) at which the way passes a level, in order, by bisection within the steps that straddle it."""
    side = np.sign(position_m - level_m)
    k = np.flatnonzero(side[:-1] * side[1:] < 0)
    low, high, start = time_s[k].copy(), time_s[k + 1].copy(), side[k]
    for _ in range(50):
        middle = (low + high) / 2
        before = np.sign(position_at(time_s, position_m, velocity_m_s, middle) - level_m) == start
        low, high = np.where(before, middle, low), np.where(before, high, middle)
    return np.sort(np.append(high, time_s[side == 0]))
