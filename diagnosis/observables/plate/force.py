"""What drives a plate: true forces from readings, brought to the clock of an acceleration."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ....twin.effects import Effect
from ....twin.sensors.effect import SensorEffect
from ....twin.sensors.effects.force_bandwidth import ForceBandwidth
from ....twin.sensors.effects.force_gain import ForceGain
from ...record import Floats, Series
from ..base import sensor_chain

#: A contact is over when its force stays below this share of its peak.
_OVER = 0.02
#: How far the impulse of samples may be off before they are too few to stand for a contact.
_NEAR = 0.2
#: Goings back and forth that undo an effect without an inverse of its own.
_ROUNDS = 40
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
    """The force on the plate under a reading: what the force channel does to it undone, last in the chain first.

    Other effects on the force than gain and low pass are undone by going back and forth, which closes in on the force
    where an effect changes it by less than itself.
    """
    acting = sensor_chain(effects, "measured_force_n").effects
    values = reading.values
    for effect in reversed(acting):
        values = _undone(effect, values, 1 / reading.sampling_rate_hz)
    return replace(reading, values=values) if acting else reading


def _undone(effect: SensorEffect, reading: Floats, step_s: float) -> Floats:
    if isinstance(effect, ForceGain):
        return np.asarray(reading / effect.gain)
    if isinstance(effect, ForceBandwidth):  # both differential equations of the low passes, read from right to left
        seconds = float(np.asarray(effect.corner_period_s)) / (2 * np.pi)
        if seconds > 0:
            rate = _rate(reading, step_s)
            reading = reading + np.sqrt(2) * seconds * rate + seconds**2 * _rate(rate, step_s)
        return np.asarray(reading + effect.time_constant_s * _rate(reading, step_s))
    force = reading
    for _ in range(_ROUNDS):
        force = force + reading - effect.measured_force_n(force, step_s)
    return force


def _rate(values: Floats, step_s: float) -> Floats:
    """Change per second, by differences of sixth order: a force has content up to a tenth of its sampling rate."""
    from scipy.signal import savgol_filter

    return np.asarray(savgol_filter(values, 7, 6, deriv=1, delta=step_s, mode="nearest"))


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
