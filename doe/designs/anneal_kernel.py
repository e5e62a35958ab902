"""The annealing of `exchange`, compiled, for a design in a landscape that is tabulated whole.

A step weighs hundreds of swaps, each of a few additions: in NumPy nearly all of its time is that of calls.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from ...array_types import Floats, Ids


@njit(cache=True)
def annealed(
    table: Floats, field: Floats, levels: Ids, strides: Ids, rows: Ids, draws: Floats, temperatures: Floats
) -> Ids:
    """The best runs (n, axes) met from `levels` (n, axes), a step for each of `rows`, `draws` and `temperatures`.

    `table` (size, size) is the criterion between treatments, `field` (size,) twice its sum with all runs and what a
    treatment brings alone. `field` and `levels` are changed. A step swaps one level of a run with another run, drawn
    by the Boltzmann distribution from all such swaps and the choice of staying.
    """
    n, axes = levels.shape
    ids = (levels * strides).sum(axis=1)
    change, total = np.empty(n * axes), np.empty(n * axes)
    best, height, lowest = levels.copy(), 0.0, 0.0
    for step in range(len(rows)):
        row, temperature = rows[step], temperatures[step]
        a, floor = ids[row], 0.0
        for partner in range(n):
            b = ids[partner]
            loss = field[a] - table[a, a] + field[b] - table[b, b] - 4 * table[a, b]
            for axis in range(axes):
                moved = (levels[partner, axis] - levels[row, axis]) * strides[axis]
                if moved == 0:
                    change[partner * axes + axis] = np.inf
                    continue
                x, y = a + moved, b - moved
                gain = field[x] + table[x, x] - 2 * (table[a, x] + table[b, x])
                gain += field[y] + table[y, y] - 2 * (table[a, y] + table[b, y])
                change[partner * axes + axis] = gain - loss
                floor = min(floor, gain - loss)
        reached = 0.0
        for cell_step in range(n * axes):
            reached += math.exp((floor - change[cell_step]) / temperature)
            total[cell_step] = reached
        drawn = draws[step] * (reached + math.exp(floor / temperature))
        if drawn >= reached:
            continue
        choice = np.searchsorted(total, drawn, side="right")
        partner, axis = choice // axes, choice % axes
        b = ids[partner]
        moved = (levels[partner, axis] - levels[row, axis]) * strides[axis]
        for treatment in range(len(field)):
            new = table[a + moved, treatment] + table[b - moved, treatment]
            field[treatment] += 2 * (new - table[a, treatment] - table[b, treatment])
        ids[row], ids[partner] = a + moved, b - moved
        levels[row, axis], levels[partner, axis] = levels[partner, axis], levels[row, axis]
        height += change[choice]
        if height < lowest - 1e-9:
            best, lowest = levels.copy(), height
    return best
