"""What a plate's accelerometers feel over a whole recording: each blow in full, and the ringing
between them.

While a blow lasts, the response is made on a fine grid and goes through mounting and anti-alias
filter. Then every mode rings freely, which has a closed form at the recorder's own rate: lambda =
-z w + i w sqrt(1 - z^2), mode r at sensor s Im(phi_s phi_impact lambda^2 / w_d Z exp(lambda t)), Z
the force's integral with exp(-lambda t). Earlier blows go on.

The plates of a campaign, solved once for all its recordings.

Short pulses put into a long recording: a fine grid around each that lines up with the recorder's
samples.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from ...parallel.executor import usual_jobs
from ..effects import Effects
from ..impact.build import ImpactTarget
from ..impact.echoes import PlateEchoes
from ..plate.build import OUTLINE_M, Boundary, resonant_plate
from ..plate.modes import PlateModes, modes
from ..plate.respond import respond
from ..recorder import Value
from ..sensors import SensorBuild, analog
from ..sensors.chain import corner_hz
from ..sensors.filters import (
    anti_alias_reach,
    anti_alias_taps,
    low_pass_decay_1_s,
    resonance_hz,
    transmissibility,
)

#: A force below this share of its peak, behind it, is over.
_OVER = 1e-5


def window(start_s: float, stop_s: float, rate_hz: float, ratio: int) -> tuple[int, Floats]:
    """The recorder's first sample and times (n * ratio,) from it on, `ratio` to a sample, around
    `start_s` to `stop_s`.

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
    """Add what `sensor` makes of a pulse (m,) that begins at `start_s` and ends at zero to a
    recording `out`, SI."""
    first, grid = window(
        start_s, start_s + float(time_s[-1]) + settling_s((sensor,), effects), rate_hz, ratio
    )
    add_at(
        out, first, analog(grid, placed(grid, start_s, time_s, signal), sensor, rate_hz, effects)
    )


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
    """A force (n,) on even fine times (n,) of the recording's clock, `ratio` of them to a sample,
    zero at both ends.

    `first` is the recorder's sample at the first time; `over` the fine index from which the force
    is zero.
    """

    first: int
    ratio: int
    time_s: Floats
    force_n: Floats
    over: int


def blow(
    start_s: float, time_s: Floats, force_n: Floats, rate_hz: float, ratio: int, settle_s: float
) -> Blow:
    """A pulse (n,), its times from its own start, put at `start_s` into a recording, with
    `settle_s` after it."""
    size = np.abs(force_n)
    loud = np.flatnonzero(size > _OVER * size.max())
    length = int(loud[-1]) + 2 if loud.size else 2
    time_s, force_n = time_s[:length], force_n[:length]
    end = start_s + float(time_s[-1])
    first, grid = window(start_s, end + settle_s + anti_alias_reach() / rate_hz, rate_hz, ratio)
    over = min(grid.size - 1, int(np.searchsorted(grid, end)) + 1)
    return Blow(first, ratio, grid, placed(grid, start_s, time_s, force_n), over)


Complex = NDArray[np.complex128]

#: Samples that one table of exponentials covers, and how many of them go on with the same modes.
_BLOCK, _BLOCKS = 1024, 8
#: A mode that has fallen below this share of the loudest is silent: 24 bits see 1.2e-7 of full
#: scale.
_SILENT = 1e-9


def ringing_accelerations(
    blows: Sequence[Blow],
    samples: int,
    modes: PlateModes,
    impact_shape: Floats,
    response: Callable[[Floats, Floats], Floats],
    sensors: Sequence[SensorBuild],
    rate_hz: float,
    effects: Mapping[str, float],
) -> Floats:
    """Band-limited accelerations (sensors, samples), SI, of blows in time order on one point of a
    plate.

    `impact_shape` (m,) is the modes' shape at that point; `response(time, force)` gives (sensors,
    n) from rest.
    """
    out = np.zeros((len(sensors), samples))
    roots, weights = _roots(modes), _weights(modes, impact_shape, sensors, rate_hz, blows, effects)
    state, at = np.zeros(roots.size, dtype=np.complex128), 0
    for hit in blows:
        # samples of the blow's window that do not see its end through the anti-alias filter
        unaffected = hit.time_s.size // hit.ratio - anti_alias_reach() - 1
        for row, signal, sensor in zip(
            out, response(hit.time_s, hit.force_n), sensors, strict=True
        ):
            add_at(
                row, hit.first, analog(hit.time_s, signal, sensor, rate_hz, effects)[:unaffected]
            )
        taken_over = min(
            max(hit.first + unaffected, 0), samples
        )  # from here on the modes ring freely
        state = _ring(out, at, taken_over, state, roots, weights, rate_hz)
        state = state + _states_after(hit, roots, (hit.first + unaffected) / rate_hz)
        at = taken_over
    _ring(out, at, samples, state, roots, weights, rate_hz)
    return out


def _roots(modes: PlateModes) -> Complex:
    omega = 2 * np.pi * modes.frequencies_hz
    return np.asarray(
        -modes.damping * omega + 1j * omega * np.sqrt(1 - modes.damping**2), dtype=np.complex128
    )


def _weights(
    modes: PlateModes,
    impact_shape: Floats,
    sensors: Sequence[SensorBuild],
    rate_hz: float,
    blows: Sequence[Blow],
    effects: Mapping[str, float],
) -> Complex:
    """What a mode's state weighs at each sensor (sensors, m); a mode at 0 Hz does not accelerate on
    its own."""
    roots = _roots(modes)
    bare = (
        np.divide(roots**2, roots.imag, out=np.zeros_like(roots), where=roots.imag > 0)
        * impact_shape
    )
    if blows:
        taps = anti_alias_taps(blows[0].ratio)
        phase = np.outer(
            roots.imag / (rate_hz * blows[0].ratio), np.arange(taps.size) - taps.size // 2
        )
        bare = bare * (np.cos(phase) @ taps)
    felt_by = [transmissibility(roots, sensor, effects) for sensor in sensors]
    return np.asarray(modes.shapes * np.array(felt_by) * bare, dtype=np.complex128)


def _states_after(hit: Blow, roots: Complex, at_s: float) -> Complex:
    """The states (m,) that a blow leaves at a time after it: its force under exp(lambda (t - tau)),
    trapezoid rule."""
    acting = slice(int(np.argmax(hit.force_n != 0)), hit.over + 1)
    period = float(hit.time_s[1] - hit.time_s[0])
    return np.asarray(
        np.exp(np.outer(roots, at_s - hit.time_s[acting])) @ hit.force_n[acting] * period
    )


def _ring(
    out: Floats,
    first: int,
    stop: int,
    state: Complex,
    roots: Complex,
    weights: Complex,
    rate_hz: float,
) -> Complex:
    """Add free ringing from sample `first` to `stop`; returns the states (m,) there."""
    loudness = np.abs(state) * np.abs(weights).max(axis=0, initial=0.0)
    floor = _SILENT * float(loudness.max(initial=0.0))
    if floor > 0:
        heard_s, loud = np.full(loudness.size, -1.0), loudness > floor
        with np.errstate(divide="ignore"):  # without damping for ever
            heard_s[loud] = np.log(loudness[loud] / floor) / -roots.real[loud]
        order = np.argsort(-heard_s)  # what is heard longest comes first
        heard_s, roots_in_order = heard_s[order], roots[order]
        amplitudes = weights[:, order] * state[order]
        table = _exponentials(roots_in_order, rate_hz)
        for start in range(first, stop, _BLOCKS * _BLOCK):
            alive = int(np.searchsorted(-heard_s, -(start - first) / rate_hz))
            if not alive:
                break
            since = (start - first + _BLOCK * np.arange(_BLOCKS)) / rate_hz
            phasors = amplitudes[:, None, :alive] * np.exp(np.outer(since, roots_in_order[:alive]))
            # The imaginary part of phasors times exponentials, for all sensors and blocks.
            rows = phasors.reshape(-1, alive).view(np.float64)
            wave = rows @ table[: 2 * alive]
            part = out[:, start : min(stop, start + _BLOCKS * _BLOCK)]
            part += wave.reshape(len(weights), -1)[:, : part.shape[1]]
    return np.asarray(state * np.exp(roots * (max(0, stop - first) / rate_hz)))


def _exponentials(roots: Complex, rate_hz: float) -> Floats:
    """exp(lambda t) at the first samples of a block (2 m, n): of each root the imaginary part, and
    below it the real one.

    exp(lambda (j + k)) is a product: two short tables instead of one number for each.
    """
    short = math.isqrt(_BLOCK)
    coarse, fine = (
        np.exp(np.outer(roots, step * np.arange(short) / rate_hz)) for step in (short, 1)
    )
    table = (coarse[:, :, None] * fine[:, None, :]).reshape(-1, _BLOCK)
    return np.stack([table.imag, table.real], axis=1).reshape(-1, _BLOCK)


Key = tuple[str, Boundary]

#: The bench's plates are 10 mm thick.
THICKNESS_M = 0.010
#: The pass band of 51.2 kHz; at 100 kHz the modes beyond are missing, and with them what short
#: pulses excite there.
MAX_FREQUENCY_HZ = 20e3
BOUNDARIES: Mapping[str, Boundary] = {"free": "free", "fixed": "fixed"}
_LIBRARY: tuple[Key, ...] = (
    ("aluminum", "free"),
    ("aluminum", "fixed"),
    ("steel", "free"),
    ("steel", "fixed"),
)


def solved_plates(
    keys: Iterable[Key],
    effects: Effects,
    rng: np.random.Generator,
    heights_m: Sequence[float] = (0.0,),
) -> Mapping[Key, PlateModes]:
    """Modes of the plates asked for, with the impact points of each height at which a plate hangs
    one after the other: a plate that hangs higher is struck lower. Each plate's damping has its own
    place in `rng`, whichever are asked for.

    Raises `ValueError` for a plate that the bench has not got.
    """
    wanted = set(keys)
    if unknown := wanted.difference(_LIBRARY):
        library_materials = ", ".join(sorted({material for material, _ in _LIBRARY}))
        raise ValueError(
            f"plan: plate_material is {min(unknown)[0]!r}; expected one of {library_materials}"
        )
    generators = dict(zip(_LIBRARY, rng.spawn(len(_LIBRARY)), strict=True))
    plates = {key: resonant_plate(*key, generators[key]) for key in _LIBRARY if key in wanted}
    for key, plate in plates.items():
        points = tuple((x, y - height) for height in heights_m for x, y in plate.impact_points_m)
        plates[key] = replace(plate, impact_points_m=points)
    # Beside each other: one solution uses one thread of linear algebra (`simulate`).
    with ThreadPoolExecutor(usual_jobs()) as threads:
        solve = partial(modes, effects=effects, max_frequency_hz=MAX_FREQUENCY_HZ)
        return dict(zip(plates, threads.map(solve, plates.values()), strict=True))


def response_at(plate: PlateModes, point: int) -> Callable[[Floats, Floats], Floats]:
    """The plate's accelerations (sensors, n) under a force (n,) at one of its impact points, from
    rest."""

    def response(time_s: Floats, force_n: Floats) -> Floats:
        acting = np.flatnonzero(force_n)
        if not acting.size:
            return np.zeros((plate.shapes.shape[0], time_s.size))
        stretch = slice(max(0, int(acting[0]) - 1), int(acting[-1]) + 2)
        return respond(plate, time_s[stretch], force_n[stretch], time_s, point=point)

    return response


def echoes_at(plate: PlateModes, point: int, target: ImpactTarget) -> PlateEchoes:
    """What a plate sends back to one of its impact points while it is struck there."""
    return PlateEchoes(
        plate.frequencies_hz, plate.damping, plate.shape_impact[point], target.plate_impedance_n_s_m
    )


def plate_stage(material: str) -> dict[str, Value]:
    """`[bench.plate]`: what the lab's drawing says."""
    return {
        "material": material,
        "thickness_m": THICKNESS_M,
        "outline_m": [list(corner) for corner in OUTLINE_M],
    }
