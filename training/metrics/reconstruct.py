"""From 20 points back to a pulse (thesis, section 4.2.2 and Fig. 4.9).

The thesis feeds MATLAB's `csaps` the times in seconds; at such a scale its smoothing is whatever the scaling makes of
it. On the point's index the problem is the same for every pulse. The points were read off a smoothed pulse already, so
nothing is smoothed again: the natural cubic spline through them is csaps' limit p = 1. Tried on 1,800 pulses against
the stored fine ones: off by 0.10 % of the range (rms), with lam = 0.03 by 0.16 %, with lam = 0.3 by 0.49 %; straight
lines 0.38 %. Not-a-knot ends would make it 0.08 %, but are not csaps'.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from ...array_types import Floats
from ...dataset.table import POINTS

#: Elements of a reconstructed pulse. The thesis prints no m; its cost of 611.57 (Table 5.2) needs more than 611.
ELEMENTS = 1000


@dataclass(frozen=True, eq=False)
class PulseFigures:
    """What Table 5.3 compares, n-arrays, SI. Compression ends at the greatest force."""

    peak_force_n: Floats
    compression_time_s: Floats
    impulse_n_s: Floats
    compression_impulse_n_s: Floats


def reconstruct(force_n: Floats, elements: int = ELEMENTS) -> Floats:
    """Forces (n x elements), equidistant over the contact, from forces (n x p) at equidistant points, p >= 3."""
    return force_n @ _basis(force_n.shape[1], elements).T


def figures(fine_n: Floats, contact_time_s: Floats) -> PulseFigures:
    """Figures of pulses (n x elements) that last `contact_time_s` (n,)."""
    n, elements = fine_n.shape
    period = contact_time_s / (elements - 1)
    top = np.argmax(fine_n, axis=1)
    rows = np.arange(n)
    grown = np.zeros_like(fine_n)
    np.cumsum((fine_n[:, 1:] + fine_n[:, :-1]) / 2, axis=1, out=grown[:, 1:])
    return PulseFigures(
        peak_force_n=fine_n[rows, top],
        compression_time_s=top * period,
        impulse_n_s=grown[:, -1] * period,
        compression_impulse_n_s=grown[rows, top] * period,
    )


@lru_cache(maxsize=8)
def _basis(points: int = POINTS, elements: int = ELEMENTS) -> Floats:
    """The spline is linear in its points: elements x points, read-only."""
    from scipy.interpolate import CubicSpline

    if points < 3 or elements < 2:
        raise ValueError(f"a pulse of {points} points cannot become one of {elements}: give at least 3 and 2")
    spline = CubicSpline(np.arange(points, dtype=np.float64), np.eye(points), bc_type="natural")
    basis: Floats = np.asarray(spline(np.linspace(0.0, points - 1.0, elements)), dtype=np.float64)
    basis.flags.writeable = False
    return basis
