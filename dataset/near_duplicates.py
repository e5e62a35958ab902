"""Pulses that are copies of each other but for round-off or a change of unit and back: they are no
two measurements.

Two measured pulses never agree so closely: one step of a 24-bit recorder is 1e-7 of its range, and
its noise some steps of each sample.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..array_types import Floats

#: Pulses are copies where contact time, peak, impulse and every point of the force, over the peak,
#: agree to this share.
TOLERANCE = 1e-6


def duplicate_groups(
    key: NDArray[np.str_],
    force_n: Floats,
    peak_force_n: Floats,
    contact_time_s: Floats,
    impulse_n_s: Floats,
) -> NDArray[np.intp]:
    """The first row, in the order of keys (n,), of the pulses that each pulse is a copy of; its own
    for all others.

    Pulses are sorted by their peak, so that each is compared only with those whose peak is as near.
    """
    figures = _figures(force_n, peak_force_n, contact_time_s, impulse_n_s)
    order = np.lexsort((key, figures[:, 0]))
    first = np.arange(len(key), dtype=np.intp)
    for place, row in enumerate(order.tolist()):
        for other in order[place + 1 :].tolist():
            if figures[other, 0] - figures[row, 0] > TOLERANCE:
                break
            if np.all(np.abs(figures[other] - figures[row]) <= TOLERANCE):
                first[first == first[other]] = first[row]
    for group in np.unique(first):
        rows = np.flatnonzero(first == group)
        if len(rows) > 1:
            first[rows] = rows[np.argsort(key[rows])[0]]
    return first


def _figures(
    force_n: Floats, peak_force_n: Floats, contact_time_s: Floats, impulse_n_s: Floats
) -> Floats:
    """(n x 23): logarithms of peak, contact time and impulse, and the force over the peak."""
    tiny = np.finfo(np.float64).tiny
    scale = np.maximum(np.abs(peak_force_n), tiny)
    positive = np.column_stack([scale, np.abs(contact_time_s), np.abs(impulse_n_s)])
    return np.column_stack([np.log(np.maximum(positive, tiny)), force_n / scale[:, None]])
