"""Pulses at a few phases: without the tail of contacts that end slowly."""

from __future__ import annotations

import numpy as np

from ...array_types import Floats
from ..contact_interface import ForcePulses
from .pulse import ContactPulse

#: Force over peak below which a slow end is cut off.
LEAST_SHARE = 1e-3
#: A contact ends slowly where its compression is less than this share of it.
_SLOW = 0.25
_DENSE = np.linspace(0.0, 1.0, 1001) ** 2


def trimmed(pulse: ContactPulse, points: int) -> ForcePulses:
    """Force at equidistant phases, (n, points).

    With little restitution bodies part slowly: the contact lasts many times as long as the pulse, most of it with
    next to no force, and a few phases of it would miss the pulse. Such contacts end here where the force falls below
    1e-3 of the peak for good.
    """
    force, time = pulse.force_n(points), pulse.contact_time_s.copy()
    slow = np.flatnonzero(pulse.compression_time_s < _SLOW * time)
    if len(slow):
        for row, dense in zip(slow, pulse.force_at(_DENSE)[slow], strict=True):
            share = _end(dense)
            time[row] *= share
            force[row] = np.interp(share * np.linspace(0, 1, points), _DENSE, dense)
            force[row, -1] = 0.0
    return ForcePulses(time, force, pulse.compression_time_s)


def _end(force: Floats) -> float:
    """Phase after which the force at the dense phases is small for good."""
    last = int(np.flatnonzero(force > LEAST_SHARE * force.max())[-1])
    return float(_DENSE[min(last + 1, len(_DENSE) - 1)])
