"""What drives a plate: true forces from readings, brought to the clock of an acceleration."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ....array_types import Floats
from ....twin.effects import Effect
from ...record import Series
from ..base import sensor_chain

#: A contact is over when its force stays below this share of its peak.
_OVER = 0.02
#: How far the impulse of samples may be off before they are too few to stand for a contact.
_NEAR = 0.2
#: Samples on either side of a contact that are kept, and in how many more the force fades: a cut would be a jump, which
#: the inverse of a low pass makes much of.
_AROUND, _FADE = 8, 16


def contact(force: Series) -> Series:
    """The force with its noise before and after the contact faded out."""
    acting = _acting(force)
    if not acting.size:
        return replace(force, values=np.zeros_like(force.values))
    # from the peak outwards, with gaps of `_AROUND` at most, so that a spike of noise far from it is no contact
    parts = np.split(acting, np.flatnonzero(np.diff(acting) > _AROUND) + 1)
    peak = int(np.argmax(np.abs(force.values)))
    part = next(part for part in parts if part[-1] >= peak)
    place = np.arange(force.values.size)
    away = np.maximum(np.maximum(part[0] - place, place - part[-1]) - _AROUND, 0)
    fade = 0.5 * (1 + np.cos(np.pi * np.minimum(away / _FADE, 1.0)))
    return replace(force, values=force.values * fade)


def end_of(force: Series) -> float:
    """When the contact is over, s on the clock of the record."""
    acting = _acting(force)
    return float(force.time_s[acting[-1]]) if acting.size else force.start_s


def _acting(force: Series) -> NDArray[np.intp]:
    """The samples at which a force acts."""
    values = np.abs(force.values)
    return np.flatnonzero(values > _OVER * values.max(initial=0.0))


def true_force(reading: Series, effects: Sequence[Effect]) -> Series:
    """The force on the plate under a reading: what the force channel does to it undone."""
    chain = sensor_chain(effects, "measured_force_n")
    if not chain.effects:
        return reading
    return replace(reading, values=chain.true_force_n(reading.values, 1 / reading.sampling_rate_hz))


def on_clock(force: Series, first_s: float, step_s: float, samples: int) -> Floats:
    """(samples,) from `first_s` in steps of `step_s`, of the same impulse; 0 outside of the series."""
    at = first_s + step_s * np.arange(samples)
    sampled = np.interp(at, force.time_s, force.values, left=0.0, right=0.0)
    if step_s * force.sampling_rate_hz <= 1 + 1e-9:
        return np.asarray(sampled)
    impulse = float(force.values.sum()) / force.sampling_rate_hz
    sampled_impulse = float(sampled.sum()) * step_s
    if impulse > 0 and abs(sampled_impulse / impulse - 1) < _NEAR:
        return np.asarray(sampled * (impulse / sampled_impulse))
    # a contact of hardly a sample: each of its values is shared out between the two samples around it
    place = (force.time_s - first_s) / step_s
    before = np.floor(place).astype(np.intp)
    out = np.zeros(samples)
    for index, weight in ((before, 1 - (place - before)), (before + 1, place - before)):
        good = (index >= 0) & (index < samples)
        np.add.at(out, index[good], (weight * force.values)[good] / (step_s * force.sampling_rate_hz))
    return out
