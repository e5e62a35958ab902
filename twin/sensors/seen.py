"""A pulse as the force channel shows it."""

from __future__ import annotations

import numpy as np

from ..sampling import sampled
from ..strikes import Floats, Pulses
from .chain import SensorChain

#: Least steps to a contact; how many longest contacts a series covers; where a pulse ends, over its peak.
_STEPS, _ROOM, _END = 256, 3, 0.005


def seen_pulses(chain: SensorChain, pulses: Pulses) -> Pulses:
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
        room = _with_room(pulses, step)  # all rows: an effect may have a value for each
        measured = chain.measured_force_n(room, step)[rows]
        if not np.array_equal(measured, room[rows]):
            seen = _cut(measured, step, Pulses(time[rows], force[rows], turn[rows]))
            time[rows], force[rows], turn[rows] = seen.contact_time_s, seen.force_n, seen.compression_time_s
            changed = True
    return Pulses(time, force, turn) if changed else pulses


def _with_room(pulses: Pulses, step: float) -> Floats:
    """Forces in these steps and zeros after them, three times what the octave's longest takes; longer ones are cut."""
    longest = 2 * _STEPS + 2
    force = sampled(pulses, step, longest)
    room = np.zeros((len(force), _ROOM * longest))
    room[:, : force.shape[1]] = force
    return room


def _cut(force: Floats, step: float, pulses: Pulses) -> Pulses:
    time = np.arange(force.shape[1]) * step
    peak = force.max(axis=1, keepdims=True)
    last = force.shape[1] - 1 - np.argmax(force[:, ::-1] > _END * peak, axis=1)
    end = np.maximum(pulses.contact_time_s, last * step)
    phases = np.linspace(0.0, 1.0, pulses.force_n.shape[1])
    rows = [np.interp(phases * each, time, row) for each, row in zip(end, force, strict=True)]
    late = np.argmax(force, axis=1) * step - _peak_time(pulses)
    return Pulses(end, np.array(rows), pulses.compression_time_s + np.maximum(late, 0.0))


def _peak_time(pulses: Pulses) -> Floats:
    share = np.argmax(pulses.force_n, axis=1) / (pulses.force_n.shape[1] - 1)
    return np.asarray(share * pulses.contact_time_s)
