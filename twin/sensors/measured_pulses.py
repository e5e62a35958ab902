"""A pulse as the force channel shows it."""

from __future__ import annotations

import numpy as np

from ...array_types import Flags, Floats, Index
from ..contact_interface import ForcePulses
from ..sampling import sampled
from .chain import SensorChain

#: Least steps to a contact; where a pulse ends, over its peak.
_STEPS, _END = 256, 0.005
#: How many of an octave's longest contacts a series covers: more, where a filter's tail takes more, up to the last.
_ROOM = (3, 6, 12, 24, 48)


def seen_pulses(chain: SensorChain, pulses: ForcePulses) -> ForcePulses:
    """Pulses (n, p) as measured, again at p phases; a filter's tail lengthens the contact, to 0.5 % of the peak.

    Contacts of one octave are seen together, in steps of the shortest: one of seconds beside one of microseconds would
    take gigabytes. Where no effect changes the force they are the same object.
    """
    if not chain.effects:
        return pulses
    time, force, turn = (x.copy() for x in (pulses.contact_time_s, pulses.force_n, pulses.compression_time_s))
    octaves = np.floor(np.log2(pulses.contact_time_s))
    changed = False
    for octave in np.unique(octaves):
        rows = np.flatnonzero(octaves == octave)
        step = float(pulses.contact_time_s[rows].min()) / _STEPS
        given, measured = _with_room(chain, pulses, rows, step)
        if not np.array_equal(measured, given):
            seen = _cut(measured, step, ForcePulses(time[rows], force[rows], turn[rows]))
            time[rows], force[rows], turn[rows] = seen.contact_time_s, seen.force_n, seen.compression_time_s
            changed = True
    return ForcePulses(time, force, turn) if changed else pulses


def _with_room(chain: SensorChain, pulses: ForcePulses, rows: Index, step: float) -> tuple[Floats, Floats]:
    """Forces of the rows in these steps, zeros after them, and what the channel shows of it until nearly nothing."""
    longest = 2 * _STEPS + 2
    force = sampled(pulses, step, longest)  # all rows: an effect may have a value for each
    for times in _ROOM:
        room = np.zeros((len(force), times * longest))
        room[:, : force.shape[1]] = force
        measured = chain.measured_force_n(room, step)[rows]
        if not np.any(_above_end(measured)[:, -1]):
            break
    return room[rows], measured


def _above_end(force: Floats) -> Flags:
    return np.asarray(force > _END * force.max(axis=1, keepdims=True))


def _cut(force: Floats, step: float, pulses: ForcePulses) -> ForcePulses:
    time = np.arange(force.shape[1]) * step
    last = np.max(np.arange(force.shape[1]) * _above_end(force), axis=1)
    end = np.maximum(pulses.contact_time_s, last * step)
    phases = np.linspace(0.0, 1.0, pulses.force_n.shape[1])
    rows = [np.interp(phases * end_s, time, row) for end_s, row in zip(end, force, strict=True)]
    late = np.argmax(force, axis=1) * step - _peak_time(pulses)
    return ForcePulses(end, np.array(rows), pulses.compression_time_s + np.maximum(late, 0.0))


def _peak_time(pulses: ForcePulses) -> Floats:
    share = np.argmax(pulses.force_n, axis=1) / (pulses.force_n.shape[1] - 1)
    return np.asarray(share * pulses.contact_time_s)
