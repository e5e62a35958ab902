"""Which mode that was found is which of the table: an alignment that keeps the order.

Needleman and Wunsch, J. Mol. Biol. 48 (1970) 443, with modes in the place of letters. It is tried for the plate as the
table has it and for plates with other frequencies; the plate that fits best names the modes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ....twin.effects import catalogue
from ....twin.plate.effect import PlateEffect
from ....twin.plate.modal import ModalPlate
from ...record import Floats

Rows = NDArray[np.intp]

#: How far a mode may lie from where a candidate plate has it, in ln frequency, at the cost of 1.
_WIDTH = 0.02
#: Cost of another pattern over channels and runs, and of a mode that finds no partner: at least, and for each decade.
_PATTERN, _ALONE, _DECADE = 4.0, 1.0, 2.0
#: Modes below this share of the loudest are not expected to be found.
_SILENT = 0.01
#: From one candidate to the next no mode moves by more than this, in ln frequency; so many at most to each effect.
_STEP, _MOST = 0.015, 16


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

    @property
    def pattern(self) -> Floats:
        """(M, k): levels of the size one."""
        return np.asarray(self.level / np.maximum(np.linalg.norm(self.level, axis=1, keepdims=True), 1e-300))


def matched(lines: Lines, candidates: Sequence[Lines], *, patterns: bool = True) -> Rows:
    """(M,): for each mode the line that is it, -1 for none; `candidates` are plates with the same M modes in order.

    Without `patterns` the levels of the plates are not known, and frequencies alone tell.
    """
    costs, rows = zip(*(_aligned(lines, plate, patterns) for plate in candidates), strict=True)
    return np.asarray(rows[int(np.argmin(costs))])


def _aligned(lines: Lines, plate: Lines, patterns: bool) -> tuple[float, Rows]:
    """The cost of the best alignment with a plate, and its rows."""
    pair = np.asarray(np.log(lines.frequency_hz[None, :] / plate.frequency_hz[:, None]) / _WIDTH) ** 2
    line_alone, mode_alone = lines.cost_alone, np.full(plate.frequency_hz.size, _ALONE)
    if patterns:
        mode_alone = plate.cost_alone
        silent = mode_alone[:, None] == 0  # a mode that is not expected takes no line from its neighbours
        pair = np.where(silent, np.inf, pair + _PATTERN * (1 - plate.pattern @ lines.pattern.T))
    m, k = pair.shape
    cost = np.zeros((m + 1, k + 1))
    cost[1:, 0], cost[0, 1:] = np.cumsum(mode_alone), np.cumsum(line_alone)
    for i in range(1, m + 1):
        for j in range(1, k + 1):
            both = cost[i - 1, j - 1] + pair[i - 1, j - 1]
            cost[i, j] = min(both, cost[i - 1, j] + mode_alone[i - 1], cost[i, j - 1] + line_alone[j - 1])
    rows = np.full(m, -1)
    i, j = m, k
    while i and j:  # the way back through the costs
        if cost[i, j] == cost[i - 1, j - 1] + pair[i - 1, j - 1]:
            i, j = i - 1, j - 1
            rows[i] = j
        elif cost[i, j] == cost[i - 1, j] + mode_alone[i - 1]:
            i -= 1
        else:
            j -= 1
    return float(cost[m, k]), rows


def candidate_plates(nominal: ModalPlate) -> list[ModalPlate]:
    """The nominal plate and those that any one effect of the plate makes of it within what is likely.

    All have the same number of modes in rising order, the k-th of each the k-th of the nominal one.
    """
    plates = [nominal]
    for kind in catalogue().values():
        if issubclass(kind, PlateEffect):
            for item in kind.parameters():
                if item.likely is not None:
                    low, high = (kind(**{item.name: end}).apply(nominal).frequency_hz for end in item.likely)
                    elastic = (low > 0) & (high > 0)
                    farthest = float(np.max(np.abs(np.log(low[elastic] / high[elastic])), initial=0.0))
                    count = min(_MOST, int(np.ceil(farthest / _STEP)) + 1)
                    values = np.linspace(*item.likely, count) if count > 1 else ()
                    plates += [kind(**{item.name: float(value)}).apply(nominal) for value in values]
    return plates
