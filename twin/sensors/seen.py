"""A pulse as the force channel shows it."""

from __future__ import annotations

import numpy as np

from ..sampling import sampled
from ..strikes import Floats, Pulses
from .chain import SensorChain

#: Steps to the shortest contact; how many longest contacts a series covers; where a pulse ends, over its peak.
_STEPS, _ROOM, _END = 256, 3.0, 0.005


def seen_pulses(chain: SensorChain, pulses: Pulses) -> Pulses:
    """Pulses (n, p) as measured, again at p phases; a filter's tail lengthens the contact, to 0.5 % of the peak.

    Where no effect changes the force they are the same object.
    """
    if not chain.effects:
        return pulses
    step = float(pulses.contact_time_s.min()) / _STEPS
    force = sampled(pulses, step)
    room = np.zeros((len(force), int(_ROOM * force.shape[1])))
    room[:, : force.shape[1]] = force
    measured = chain.measured_force_n(room, step)
    return pulses if np.array_equal(measured, room) else _cut(measured, step, pulses)


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
