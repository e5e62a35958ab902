"""The compiled loop over samples and blocks of modes."""

from __future__ import annotations

import numpy as np
from numba import njit

from ...array_types import Complexes, Floats

#: Modes that go through one loop over time together: their states stay in registers or the first cache.
BLOCK = 32


@njit(cache=True, fastmath={"reassoc", "contract", "nsz"})
def _ring(
    turn_r: Floats,
    turn_i: Floats,
    before_r: Floats,
    before_i: Floats,
    after_r: Floats,
    after_i: Floats,
    weights: Floats,
    force: Floats,
    out: Floats,
) -> None:
    """Adds the sum over modes of weight times Im(w) to `out` (k, sensors, n).

    Modes lie in blocks (blocks, BLOCK), `weights` (blocks, sensors, BLOCK); `force` is (k, n).
    """
    blocks, sensors = weights.shape[0], weights.shape[1]
    real, imag = np.empty(BLOCK), np.empty(BLOCK)
    for shot in range(force.shape[0]):
        for b in range(blocks):
            tr, ti, br, bi, ar, ai = turn_r[b], turn_i[b], before_r[b], before_i[b], after_r[b], after_i[b]
            rate = weights[b]
            # At rest before the first sample: a force that begins with a jump has had no time to act.
            real[:] = 0.0
            imag[:] = 0.0
            for n in range(1, force.shape[1]):
                old, new = force[shot, n - 1], force[shot, n]
                for j in range(BLOCK):
                    r = tr[j] * real[j] - ti[j] * imag[j] + br[j] * old + ar[j] * new
                    imag[j] = tr[j] * imag[j] + ti[j] * real[j] + bi[j] * old + ai[j] * new
                    real[j] = r
                for s in range(sensors):
                    total = 0.0
                    for j in range(BLOCK):
                        total += rate[s, j] * imag[j]
                    out[shot, s, n] += total


def ring(turn: Complexes, before: Complexes, after: Complexes, weights: Floats, force: Floats, out: Floats) -> None:
    """As `_ring`, for modes (m,) and `weights` (sensors, m) of any number; `out` (k, sensors, n) is added to."""
    blocks = -(-turn.size // BLOCK)
    padding = blocks * BLOCK - turn.size
    parts = (part for z in (turn, before, after) for part in (z.real, z.imag))
    tr, ti, br, bi, ar, ai = (np.pad(part, (0, padding)).reshape(blocks, BLOCK) for part in parts)
    padded = np.pad(weights, ((0, 0), (0, padding))).reshape(len(weights), blocks, BLOCK)
    _ring(tr, ti, br, bi, ar, ai, np.ascontiguousarray(padded.swapaxes(0, 1)), np.ascontiguousarray(force), out)
