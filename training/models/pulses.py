"""Small sums over pulses of equidistant points."""

from __future__ import annotations

import numpy as np

from ...array_types import Floats
from ...dataset.table import POINTS, PulseTable

#: Integral over the contact's phase from 0 to 1 by trapezoids, as weights of the points (20,).
WEIGHTS: Floats = np.full(POINTS, 1.0 / (POINTS - 1))
WEIGHTS[[0, -1]] /= 2


def impulse(force_n: Floats, contact_time_s: Floats) -> Floats:
    """N s, (n,), of force (n x 20) over contact times (n,)."""
    return np.asarray(force_n @ WEIGHTS * contact_time_s)


def positive_times(time: Floats, shortest: float) -> Floats:
    """A regression may say zero or less; a contact lasts at least a tenth of the shortest one learned."""
    return np.maximum(time, 0.1 * shortest)


def positive_pulses(force_n: Floats, faintest: float) -> Floats:
    """Pulses whose mean force is not at least a thousandth of the faintest one learned are cut off at zero, and
    raised to it at their inner points: they push, if hardly. All others stay as the regression gave them.
    """
    least = 1e-3 * faintest
    raised = np.maximum(force_n, 0.0)
    raised[:, 1:-1] = np.maximum(raised[:, 1:-1], least)
    return np.where((force_n @ WEIGHTS < least)[:, None], raised, force_n)


def faintest_mean_force(pulses: PulseTable) -> float:
    """N. Raises `ValueError` for a measured pulse whose mean force is not positive."""
    mean = pulses.force_n @ WEIGHTS
    if not np.all(mean > 0):
        row = int(np.flatnonzero(~(mean > 0))[0])
        raise ValueError(f"pulse {pulses.key[row]} has a mean force of {mean[row]:g} N: it cannot be learned from")
    return float(mean.min())
