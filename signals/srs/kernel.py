"""The compiled loop: sixteen oscillators at a time run over a record and keep their extremes and their last state.

One step from the base accelerations a0 to a1, with S, G, H of `coefficients` and K = G / theta:

    p += G (a0 - p) + S v + H (a1 - a0)
    v += S (a0 - p) - (G + 2 zeta S) v + K (a1 - a0)

Only what changes is added, so for small theta nothing is lost: the filter of ISO 18431-4 in its printed form has poles
that its coefficients tell from 1 by theta^2, and at theta = 1e-6 six digits of it are left, of this form fourteen. It
also gives relative displacement and absolute acceleration from one pair of states.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from ...array_types import Floats
from .coefficients import Steps
from .simd_vector import WIDTH, larger, load, magnitude, smaller, spread, store
from .threads import checked_threads
from .threads import spread as spread_over_threads

_COEFFICIENTS, _FOUND = 5, 5
#: Zeros in a record let the states decay to subnormal numbers, on which processors are slow; this, with its sign
#: changing at every sample, keeps them above. It is lost in the last digit of every other sample.
_DITHER = 1e-200
#: Less work than this, in steps of one oscillator, is done before another thread has begun.
_WORTH_A_THREAD = 400_000


def run(records: Floats, oscillators: Steps, threads: int | None = None) -> Floats:
    """Records (k, n) over f oscillators: (5, k, f) of max x, min x (>= 0 and <= 0), max |p|; p and v at the end.

    The first three are of the samples of the record, x being p + 2 zeta v; the last two are of one step later, where
    the base is at 0.
    """
    k, f = len(records), oscillators.theta.size
    table = _blocks(oscillators)
    extremes = np.empty((k, len(table), _FOUND, WIDTH))
    tasks, twice_zeta = k * len(table), 2 * oscillators.damping_ratio
    most = min(checked_threads(threads), 1 + tasks * WIDTH * records.shape[1] // _WORTH_A_THREAD)
    spread_over_threads(lambda start, stop: _run_tasks(records, table, twice_zeta, start, stop, extremes), tasks, most)
    return extremes.transpose(2, 0, 1, 3).reshape(_FOUND, k, -1)[..., :f]


def _blocks(each: Steps) -> Floats:
    """Coefficients (blocks, 5, WIDTH); the last oscillator fills up the last block."""
    rows = np.stack([each.g, each.s, each.h, -each.g - 2 * each.damping_ratio * each.s, each.g / each.theta])
    f = each.theta.size
    filled = np.minimum(np.arange(-(-f // WIDTH) * WIDTH), f - 1)
    return np.ascontiguousarray(rows[:, filled].reshape(_COEFFICIENTS, -1, WIDTH).transpose(1, 0, 2))


@njit(nogil=True)
def _first_sample(record):  # type: ignore[no-untyped-def]
    """The first that is not 0: until then all is at rest."""
    for i in range(record.size):
        if record[i] != 0.0:
            return i
    return record.size


@njit(nogil=True)
def _run_block(record, table, twice_zeta, found):  # type: ignore[no-untyped-def]
    g, s, h, m, k = load(table, 0), load(table, 1), load(table, 2), load(table, 3), load(table, 4)
    p = v = highest = lowest = furthest = spread(0.0)
    damping, before, dither = spread(twice_zeta), 0.0, _DITHER
    for sample in record[_first_sample(record) :]:
        now = sample + dither
        dither = -dither
        error, rise = spread(before) - p, spread(now - before)
        p, v = g * error + (s * v + (h * rise + p)), s * error + (m * v + (k * rise + v))
        x = p + damping * v
        highest, lowest, furthest = larger(x, highest), smaller(x, lowest), larger(magnitude(p), furthest)
        before = now
    error, rise = spread(before) - p, spread(-before)
    p, v = g * error + (s * v + (h * rise + p)), s * error + (m * v + (k * rise + v))
    for row, value in enumerate((highest, lowest, furthest, p, v)):
        store(found, row, value)


@njit("(f8[:, ::1], f8[:, :, ::1], f8, i8, i8, f8[:, :, :, ::1])", nogil=True, cache=True)
def _run_tasks(records, table, twice_zeta, start, stop, found):  # type: ignore[no-untyped-def]
    """Tasks count all blocks of the first record, then of the next."""
    for task in range(start, stop):
        i, block = task // len(table), task % len(table)
        _run_block(records[i], table[block], twice_zeta, found[i, block])


@njit("(f8[::1], f8, f8, f8, f8, f8, f8[:, ::1])", nogil=True, cache=True)
def run_series(record, g, s, h, k, twice_zeta, series):  # type: ignore[no-untyped-def]
    """p and v of one oscillator at each sample into `series` (2, n)."""
    p = v = before = 0.0
    for i, now in enumerate(record):
        error, rise = before - p, now - before
        p, v = p + (g * error + (s * v + h * rise)), v + (s * error - (g + twice_zeta * s) * v + k * rise)
        series[0, i], series[1, i] = p, v
        before = now
