"""What a plate's accelerometers feel over a whole recording: each blow in full, and the ringing between them.

While a blow lasts, the response is made on a fine grid and goes through mounting and anti-alias filter. Then every mode
rings freely, which has a closed form at the recorder's own rate: lambda = -z w + i w sqrt(1 - z^2), mode r at sensor s
Im(phi_s phi_impact lambda^2 / w_d Z exp(lambda t)), Z the force's integral with exp(-lambda t). Earlier blows go on.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from ..plate.modes import PlateModes
from ..sensors import SensorBuild, analog
from ..sensors.filters import anti_alias_reach, anti_alias_taps
from ..sensors.mounting import transmissibility
from .windows import Blow, add_at

Complex = NDArray[np.complex128]

#: Samples that one table of exponentials covers, and how many of them go on with the same modes.
_BLOCK, _BLOCKS = 1024, 8
#: A mode that has fallen below this share of the loudest is silent: 24 bits see 1.2e-7 of full scale.
_SILENT = 1e-9


def felt(
    blows: Sequence[Blow],
    samples: int,
    modes: PlateModes,
    impact_shape: Floats,
    response: Callable[[Floats, Floats], Floats],
    sensors: Sequence[SensorBuild],
    rate_hz: float,
    effects: Mapping[str, float],
) -> Floats:
    """Band-limited accelerations (sensors, samples), SI, of blows in time order on one point of a plate.

    `impact_shape` (m,) is the modes' shape at that point; `response(time, force)` gives (sensors, n) from rest.
    """
    out = np.zeros((len(sensors), samples))
    roots, weights = _roots(modes), _weights(modes, impact_shape, sensors, rate_hz, blows, effects)
    state, at = np.zeros(roots.size, dtype=np.complex128), 0
    for hit in blows:
        window = response(hit.time_s, hit.force_n)
        taken_over = _add_window(out, hit, window, sensors, rate_hz, effects)
        state = _ring(out, at, taken_over, state, roots, weights, rate_hz)
        state = state + _given(hit, roots, (hit.first + _kept(hit)) / rate_hz)
        at = taken_over
    _ring(out, at, samples, state, roots, weights, rate_hz)
    return out


def _kept(hit: Blow) -> int:
    """Samples of a blow's window that do not see its end through the anti-alias filter."""
    return hit.time_s.size // hit.ratio - anti_alias_reach() - 1


def _add_window(
    out: Floats,
    hit: Blow,
    window: Floats,
    sensors: Sequence[SensorBuild],
    rate_hz: float,
    effects: Mapping[str, float],
) -> int:
    """Add a blow's own response to `out`; returns the sample from which the modes ring freely."""
    for row, (signal, sensor) in enumerate(zip(window, sensors, strict=True)):
        add_at(out[row], hit.first, analog(hit.time_s, signal, sensor, rate_hz, effects)[: _kept(hit)])
    return int(min(max(hit.first + _kept(hit), 0), out.shape[1]))


def _roots(modes: PlateModes) -> Complex:
    omega = 2 * np.pi * modes.frequencies_hz
    return np.asarray(-modes.damping * omega + 1j * omega * np.sqrt(1 - modes.damping**2), dtype=np.complex128)


def _weights(
    modes: PlateModes,
    impact_shape: Floats,
    sensors: Sequence[SensorBuild],
    rate_hz: float,
    blows: Sequence[Blow],
    effects: Mapping[str, float],
) -> Complex:
    """What a mode's state weighs at each sensor (sensors, m); a mode at 0 Hz does not accelerate on its own."""
    roots = _roots(modes)
    bare = np.divide(roots**2, roots.imag, out=np.zeros_like(roots), where=roots.imag > 0) * impact_shape
    if blows:
        taps = anti_alias_taps(blows[0].ratio)
        phase = np.outer(roots.imag / (rate_hz * blows[0].ratio), np.arange(taps.size) - taps.size // 2)
        bare = bare * (np.cos(phase) @ taps)
    felt_by = [transmissibility(roots, sensor, effects) for sensor in sensors]
    return np.asarray(modes.shapes * np.array(felt_by) * bare, dtype=np.complex128)


def _given(hit: Blow, roots: Complex, at_s: float) -> Complex:
    """The states (m,) that a blow leaves at a time after it: its force under exp(lambda (t - tau)), trapezoid rule."""
    acting = slice(int(np.argmax(hit.force_n != 0)), hit.over + 1)
    period = float(hit.time_s[1] - hit.time_s[0])
    return np.asarray(np.exp(np.outer(roots, at_s - hit.time_s[acting])) @ hit.force_n[acting] * period)


def _ring(
    out: Floats, first: int, stop: int, state: Complex, roots: Complex, weights: Complex, rate_hz: float
) -> Complex:
    """Add free ringing from sample `first` to `stop`; returns the states (m,) there."""
    loudness = np.abs(state) * np.abs(weights).max(axis=0, initial=0.0)
    floor = _SILENT * float(loudness.max(initial=0.0))
    table = np.exp(np.outer(roots, np.arange(_BLOCK) / rate_hz))
    sine, cosine = table.imag.copy(), table.real.copy()
    for start in range(first, stop, _BLOCKS * _BLOCK):
        alive = loudness * np.exp(roots.real * ((start - first) / rate_hz)) > floor
        if not alive.any():
            break
        since = (start - first + _BLOCK * np.arange(_BLOCKS)) / rate_hz
        phasors = weights[:, None, alive] * (np.exp(np.outer(since, roots[alive])) * state[alive])
        rows = phasors.reshape(-1, phasors.shape[-1])  # sensors and blocks; the imaginary part of rows times table
        wave = rows.real.copy() @ sine[alive] + rows.imag.copy() @ cosine[alive]
        part = out[:, start : min(stop, start + _BLOCKS * _BLOCK)]
        part += wave.reshape(len(weights), -1)[:, : part.shape[1]]
    return np.asarray(state * np.exp(roots * (max(0, stop - first) / rate_hz)))
