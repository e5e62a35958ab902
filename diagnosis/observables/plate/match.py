"""Which line that rings is which mode of the table: an alignment that keeps the order.

Needleman and Wunsch, J. Mol. Biol. 48 (1970) 443, with modes in the place of letters. It is tried for the plate as the
table has it and for plates with other frequencies; the plate that fits best names the modes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ....array_types import Floats, Rows
from ....twin.effects import catalogue
from ....twin.plate.effect import PlateEffect
from ....twin.plate.modal import ModalPlate

#: How far a mode may lie from where a candidate plate has it, in ln frequency, at the cost of 1.
_WIDTH = 0.02
#: Cost of another pattern over channels and runs, and of a mode that finds no partner: at least, and for each decade.
_PATTERN, _ALONE, _DECADE = 4.0, 1.0, 2.0
#: Modes below this share of the loudest are not expected to be found.
_SILENT = 0.01
#: From one candidate to the next no mode moves by more than this, in ln frequency; so many at most to each effect.
_STEP, _MOST = 0.015, 16


@dataclass(frozen=True, eq=False)
class ModeLines:
    """Frequencies (M,) in rising order, with levels (M, k) over records; None where they are not known."""

    frequency_hz: Floats
    level: Floats | None = None

    @property
    def cost_alone(self) -> Floats:
        """(M,): of a line without a partner; louder ones are missed more."""
        if self.level is None:
            return np.full(self.frequency_hz.size, _ALONE)
        size = np.linalg.norm(self.level, axis=1)
        loudness = np.log10(np.maximum(size / (_SILENT * size.max(initial=1e-300)), 1e-300))
        return np.asarray(np.where(loudness > 0, _ALONE + _DECADE * loudness, 0.0))

    def pair_cost(self, lines: ModeLines) -> Floats:
        """(M, L): of each of these modes with each of L lines."""
        cost = np.asarray(np.log(lines.frequency_hz / self.frequency_hz[:, None]) / _WIDTH) ** 2
        if self.level is None or lines.level is None:
            return cost
        pattern, other = (
            level / np.maximum(np.linalg.norm(level, axis=1, keepdims=True), 1e-300)
            for level in (self.level, lines.level)
        )
        silent = self.cost_alone[:, None] == 0  # a mode that is not expected takes no line from its neighbours
        return np.where(silent, np.inf, cost + _PATTERN * (1 - pattern @ other.T))


def matched(lines: ModeLines, candidates: Sequence[ModeLines]) -> Rows:
    """(M,): for each mode the line that is it, -1 for none; `candidates` are plates with the same M modes in order."""
    pair = np.stack([plate.pair_cost(lines) for plate in candidates], axis=2)  # (M, L, plates), as all that follows
    mode_alone, line_alone = np.stack([plate.cost_alone for plate in candidates], axis=1), lines.cost_alone
    m, k, _ = pair.shape
    costs = np.zeros((m + 1, k + 1, len(candidates)))
    costs[1:, 0], costs[0, 1:] = np.cumsum(mode_alone, axis=0), np.cumsum(line_alone)[:, None]
    for i, j in np.ndindex(m, k):
        alone = np.minimum(costs[i, j + 1] + mode_alone[i], costs[i + 1, j] + line_alone[j])
        costs[i + 1, j + 1] = np.minimum(costs[i, j] + pair[i, j], alone)
    best = int(np.argmin(costs[m, k]))
    cost, pair, mode_alone = costs[:, :, best], pair[:, :, best], mode_alone[:, best]
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
    return rows


def candidate_plates(nominal: ModalPlate) -> list[ModalPlate]:
    """The nominal plate and those that any one effect of the plate makes of it within what is likely.

    All have the same number of modes in rising order, the k-th of each the k-th of the nominal one.
    """
    plates = [nominal]
    kinds = [kind for kind in catalogue().values() if issubclass(kind, PlateEffect)]
    for effect, item in [(kind, item) for kind in kinds for item in kind.parameters()]:
        if item.likely is not None:
            low, high = (effect(**{item.name: end}).apply(nominal).frequency_hz for end in item.likely)
            elastic = (low > 0) & (high > 0)
            farthest = float(np.max(np.abs(np.log(low[elastic] / high[elastic])), initial=0.0))
            count = min(_MOST, int(np.ceil(farthest / _STEP)) + 1)
            values = np.linspace(*item.likely, count) if count > 1 else ()
            plates += [effect(**{item.name: float(value)}).apply(nominal) for value in values]
    return plates
