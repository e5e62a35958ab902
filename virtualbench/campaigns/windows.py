"""Short pulses put into a long recording: a fine grid around each that lines up with the recorder's samples."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...array_types import Floats
from ..sensors import SensorBuild, analog
from ..sensors.chain import corner_hz
from ..sensors.filters import anti_alias_reach, low_pass_decay_1_s
from ..sensors.mounting import resonance_hz

#: A force below this share of its peak, behind it, is over.
_OVER = 1e-5


def window(start_s: float, stop_s: float, rate_hz: float, ratio: int) -> tuple[int, Floats]:
    """The recorder's first sample and times (n * ratio,) from it on, `ratio` to a sample, around `start_s` to `stop_s`.

    On either side there is room for what the anti-alias filter makes of the pulse.
    """
    room = anti_alias_reach() + 2
    first = int(np.floor(start_s * rate_hz)) - room
    samples = int(np.ceil(stop_s * rate_hz)) + room - first
    return first, (first + np.arange(samples * ratio) / ratio) / rate_hz


def placed(grid_s: Floats, start_s: float, time_s: Floats, signal: Floats) -> Floats:
    """A pulse (m,), its times from its own start, on the recording's grid (n,); zero outside."""
    return np.interp(grid_s - start_s, time_s, signal, left=0.0, right=0.0)


def add_pulse(
    out: Floats,
    start_s: float,
    time_s: Floats,
    signal: Floats,
    sensor: SensorBuild,
    rate_hz: float,
    ratio: int,
    effects: Mapping[str, float],
) -> None:
    """Add what `sensor` makes of a pulse (m,) that begins at `start_s` and ends at zero to a recording `out`, SI."""
    first, grid = window(start_s, start_s + float(time_s[-1]) + settling_s((sensor,), effects), rate_hz, ratio)
    add_at(out, first, analog(grid, placed(grid, start_s, time_s, signal), sensor, rate_hz, effects))


def add_at(out: Floats, first: int, values: Floats) -> None:
    """Add `values` to `out` from sample `first` on, as far as it reaches."""
    low, high = max(first, 0), min(first + values.size, out.size)
    if low < high:
        out[low:high] += values[low - first : high - first]


def settling_s(sensors: Sequence[SensorBuild], effects: Mapping[str, float]) -> float:
    """How long (s) mountings and electronics outlast a pulse: until exp(-10)."""
    rates = [np.inf]
    for sensor in sensors:
        resonance, corner = resonance_hz(sensor, effects), corner_hz(sensor, effects)
        rates += [2 * np.pi * sensor.mount_damping * resonance] if resonance else []
        rates += [low_pass_decay_1_s(corner)] if corner else []
    return float(10 / min(rates))


@dataclass(frozen=True)
class Blow:
    """A force (n,) on even fine times (n,) of the recording's clock, `ratio` of them to a sample, zero at both ends.

    `first` is the recorder's sample at the first time; `over` the fine index from which the force is zero.
    """

    first: int
    ratio: int
    time_s: Floats
    force_n: Floats
    over: int


def blow(start_s: float, time_s: Floats, force_n: Floats, rate_hz: float, ratio: int, settle_s: float) -> Blow:
    """A pulse (n,), its times from its own start, put at `start_s` into a recording, with `settle_s` after it."""
    size = np.abs(force_n)
    loud = np.flatnonzero(size > _OVER * size.max())
    length = int(loud[-1]) + 2 if loud.size else 2
    time_s, force_n = time_s[:length], force_n[:length]
    end = start_s + float(time_s[-1])
    first, grid = window(start_s, end + settle_s + anti_alias_reach() / rate_hz, rate_hz, ratio)
    over = min(grid.size - 1, int(np.searchsorted(grid, end)) + 1)
    return Blow(first, ratio, grid, placed(grid, start_s, time_s, force_n), over)
