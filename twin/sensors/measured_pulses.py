"""A pulse as the force channel shows it.

Pulses of any duration as samples of one rate.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ...array_types import Flags, Floats, Index
from ..contact_interface import ForcePulses
from .chain import SensorChain


def sampled(pulses: ForcePulses, step_s: float, most: int | None = None) -> Floats:
    """Forces (n, p) every `step_s` from the beginning of contact, the first and the last 0,
    straight between phases.

    Each keeps the impulse of its pulse: samples of a short one are scaled, by (step / contact
    time)^2 or so, and a contact that is shorter than a step has all of its impulse in the second
    sample. No more than `most` samples, two or more, are made, and a pulse that goes on beyond
    them, which has very many, is not scaled.
    """
    longest = float(pulses.contact_time_s.max())
    samples = math.ceil(longest / step_s) + 2
    time = np.arange(samples if most is None else min(samples, most)) * step_s
    last = pulses.force_n.shape[1] - 1
    position = np.minimum(time / pulses.contact_time_s[:, None], 1.0) * last
    lower_index = np.minimum(position.astype(np.intp), last - 1)
    rows = np.arange(len(lower_index))[:, None]
    before, after = pulses.force_n[rows, lower_index], pulses.force_n[rows, lower_index + 1]
    force = before + (position - lower_index) * (after - before)
    between = pulses.contact_time_s <= step_s
    force[between] = 0.0
    force[between, 1] = (
        pulses.impulse_n_s[between] / step_s
    )  # where the sample of a slightly longer contact is
    scale = _scale(force.sum(axis=1) * step_s, pulses.impulse_n_s)
    scale[pulses.contact_time_s > time[-1]] = 1.0
    return np.asarray(force * scale[:, None])


def _scale(sampled_n_s: Floats, impulse_n_s: Floats) -> Floats:
    """1 where there is no impulse to keep."""
    has_impulse = sampled_n_s > 0
    return np.where(has_impulse, impulse_n_s / np.where(has_impulse, sampled_n_s, 1.0), 1.0)


@dataclass(frozen=True, eq=False)
class MeasuredForce:
    """A recorded force that stands in for gun and contact: `force_n` (p,) every 1 /
    `sampling_rate_hz`.

    Raises `ValueError` for less than three samples, values that are not finite, and a rate that is
    not positive.
    """

    force_n: Floats
    sampling_rate_hz: float

    def __post_init__(self) -> None:
        if self.force_n.ndim != 1 or self.force_n.size < 3 or not np.all(np.isfinite(self.force_n)):
            raise ValueError(
                f"force_n has shape {self.force_n.shape}: expected (p,), p of 3 or more, finite"
            )
        if not (math.isfinite(self.sampling_rate_hz) and self.sampling_rate_hz > 0):
            raise ValueError(
                f"sampling_rate_hz = {self.sampling_rate_hz!r}: expected a positive number"
            )

    def repeated(self, count: int) -> ForcePulses:
        """The same pulse `count` times, from the sample before its first force to that after the
        last."""
        force = np.concatenate(([0.0], self.force_n, [0.0]))
        time = (force.size - 1) / self.sampling_rate_hz
        peak = float(np.argmax(force)) / self.sampling_rate_hz
        return ForcePulses(np.full(count, time), np.tile(force, (count, 1)), np.full(count, peak))


#: Least steps to a contact; where a pulse ends, over its peak.
_STEPS, _END = 256, 0.005
#: How many of an octave's longest contacts a series covers: more, where a filter's tail takes more,
#: up to the last.
_ROOM = (3, 6, 12, 24, 48)


def measured_pulses(chain: SensorChain, pulses: ForcePulses) -> ForcePulses:
    """Pulses (n, p) as measured, again at p phases; a filter's tail lengthens the contact, to 0.5 %
    of the peak.

    Contacts of one octave are seen together, in steps of the shortest: one of seconds beside one of
    microseconds would take gigabytes. Where no effect changes the force they are the same object.
    """
    if not chain.effects:
        return pulses
    time, force, turn = (
        x.copy() for x in (pulses.contact_time_s, pulses.force_n, pulses.compression_time_s)
    )
    octaves = np.floor(np.log2(pulses.contact_time_s))
    changed = False
    for octave in np.unique(octaves):
        rows = np.flatnonzero(octaves == octave)
        step = float(pulses.contact_time_s[rows].min()) / _STEPS
        given, measured = _with_room(chain, pulses, rows, step)
        if not np.array_equal(measured, given):
            seen = _cut(measured, step, ForcePulses(time[rows], force[rows], turn[rows]))
            time[rows], force[rows], turn[rows] = (
                seen.contact_time_s,
                seen.force_n,
                seen.compression_time_s,
            )
            changed = True
    return ForcePulses(time, force, turn) if changed else pulses


def _with_room(
    chain: SensorChain, pulses: ForcePulses, rows: Index, step: float
) -> tuple[Floats, Floats]:
    """Forces of the rows in these steps, zeros after them, and what the channel shows of it until
    nearly nothing."""
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
    peak_share = np.argmax(pulses.force_n, axis=1) / (pulses.force_n.shape[1] - 1)
    late = np.argmax(force, axis=1) * step - peak_share * pulses.contact_time_s
    return ForcePulses(end, np.array(rows), pulses.compression_time_s + np.maximum(late, 0.0))
