"""Which mode that was found is which of the table: an alignment that keeps the order.

Needleman and Wunsch, J. Mol. Biol. 48 (1970) 443, with modes in the place of letters. It is tried for the plate as the
table has it and for plates with other frequencies; the plate that fits best names the modes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...record import Floats

Rows = NDArray[np.intp]

#: How far a mode may lie from where a tried plate has it, in ln frequency, at the cost of 1.
_WIDTH = 0.02
#: Cost of another pattern over channels and runs, and of a mode that finds no partner: at least, and for each decade.
_PATTERN, _ALONE, _DECADE = 4.0, 1.0, 2.0
#: Modes below this share of the loudest are not expected to be found.
_SILENT = 0.01


@dataclass(frozen=True, eq=False)
class Lines:
    """Frequencies (M,) in rising order, with levels (M, k) over records."""

    frequency_hz: Floats
    level: Floats

    @property
    def cost_alone(self) -> Floats:
        """(M,): of a line without a partner; louder ones are missed more."""
        size = np.linalg.norm(self.level, axis=1)
        loud = np.log10(np.maximum(size / (_SILENT * size.max(initial=1e-300)), 1e-300))
        return np.asarray(np.where(loud > 0, _ALONE + _DECADE * loud, 0.0))


def matched(found: Lines, tried: Sequence[Lines], *, patterns: bool = True) -> Rows:
    """(M,): for each mode the line that is it, -1 for none; `tried` are plates with the same M modes in order.

    Without `patterns` the levels of the plates are not known, and frequencies alone tell.
    """
    costs, rows = zip(*(_aligned(found, lines, patterns) for lines in tried), strict=True)
    return np.asarray(rows[int(np.argmin(costs))])


def _aligned(found: Lines, plate: Lines, patterns: bool) -> tuple[float, Rows]:
    alone_f = found.cost_alone
    if patterns:
        pair, alone_p = _pair_cost(plate, found), plate.cost_alone
    else:
        pair, alone_p = _apart(plate, found) ** 2, np.full(plate.frequency_hz.size, _ALONE)
    m, k = pair.shape
    cost = np.zeros((m + 1, k + 1))
    cost[1:, 0], cost[0, 1:] = np.cumsum(alone_p), np.cumsum(alone_f)
    for i in range(1, m + 1):
        for j in range(1, k + 1):
            both = cost[i - 1, j - 1] + pair[i - 1, j - 1]
            cost[i, j] = min(both, cost[i - 1, j] + alone_p[i - 1], cost[i, j - 1] + alone_f[j - 1])
    return float(cost[m, k]), _walked(cost, pair, alone_p)


def _walked(cost: Floats, pair: Floats, alone_p: Floats) -> Rows:
    """The way back through the costs."""
    i, j = pair.shape
    rows = np.full(i, -1)
    while i and j:
        if cost[i, j] == cost[i - 1, j - 1] + pair[i - 1, j - 1]:
            i, j = i - 1, j - 1
            rows[i] = j
        elif cost[i, j] == cost[i - 1, j] + alone_p[i - 1]:
            i -= 1
        else:
            j -= 1
    return rows


def _apart(plate: Lines, found: Lines) -> Floats:
    """(M, k): distances of found lines from modes, in widths."""
    return np.asarray(np.log(found.frequency_hz[None, :] / plate.frequency_hz[:, None]) / _WIDTH)


def _pair_cost(plate: Lines, found: Lines) -> Floats:
    alike = _unit(plate.level) @ _unit(found.level).T
    silent = plate.cost_alone[:, None] == 0  # a mode that is not expected takes no line from its neighbours
    return np.asarray(np.where(silent, np.inf, _apart(plate, found) ** 2 + _PATTERN * (1 - alike)))


def _unit(level: Floats) -> Floats:
    return np.asarray(level / np.maximum(np.linalg.norm(level, axis=1, keepdims=True), 1e-300))
