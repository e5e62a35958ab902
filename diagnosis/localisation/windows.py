"""When, and at which frequencies, the records differ."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..verdict import Band, TimeWindow
from .means import Floats
from .spans import spans

#: Up to which part of its peak a pulse is said to agree, and by how many dB a spectrum.
PULSE_TOLERANCE, SPECTRUM_TOLERANCE_DB = 0.03, 0.5
#: Down to which part of the impulse a pulse's amplitude spectrum is looked at.
_AUDIBLE = 0.1
#: Samples that a record is brought to by averaging: shorter stretches are not told apart anyway.
_SAMPLES = 256


def time_windows(
    time_s: Floats,
    measured: Floats,
    simulated: Floats,
    configuration: NDArray[np.intp],
    channel: str,
    rng: np.random.Generator,
    tolerance: float = PULSE_TOLERANCE,
) -> tuple[TimeWindow, ...]:
    """Windows in which aligned records (R, p) differ by more than this part of the measured peak, beyond chance."""
    peak = np.nanmax(np.abs(measured), axis=1, keepdims=True, initial=1e-300)
    block = -(-len(time_s) // _SAMPLES)
    found = spans(_averaged((measured - simulated) / peak, block), configuration, tolerance, rng)
    last_sample = len(time_s) - 1
    return tuple(
        TimeWindow(channel, float(time_s[a * block]), float(time_s[min((b + 1) * block, last_sample)]))
        for a, b in found
    )


def frequency_bands(
    frequency_hz: Floats,
    residual_db: Floats,
    configuration: NDArray[np.intp],
    channel: str,
    rng: np.random.Generator,
    tolerance_db: float = SPECTRUM_TOLERANCE_DB,
) -> tuple[Band, ...]:
    """Bands in which levels (R, lines) differ, measured less simulated: of a shock response spectrum, or of a force.

    A line stands for the band around it, up to the geometric middle of it and its neighbour.
    """
    edges = _edges(frequency_hz)
    found = spans(residual_db, configuration, tolerance_db, rng)
    return tuple(Band(channel, float(edges[first]), float(edges[last + 1])) for first, last in found)


def amplitude_residual_db(
    frequency_hz: Floats, measured: Floats, simulated: Floats, lines_an_octave: int = 6
) -> tuple[Floats, Floats]:
    """Lines (m,) and measured less simulated (R, m) in dB of amplitude spectra (R, n) of pulses, brought to such lines.

    `frequency_hz` (n,) is even and begins at 0. NaN for a run from where its measured spectrum first falls below a
    tenth of its impulse: beyond, zeros of both spectra stand beside each other. Short pulses go further than long ones.
    """
    heard = np.logical_and.accumulate(measured >= _AUDIBLE * measured[:, :1], axis=1)
    last = int(heard.any(axis=0).sum()) - 1
    if last < 2:
        return np.empty(0), np.empty((len(measured), 0))
    first_hz = 0.5 * frequency_hz[1]
    octaves = np.log2(frequency_hz[last] / first_hz)
    lines = first_hz * 2.0 ** (np.arange(int(octaves * lines_an_octave) + 1) / lines_an_octave)
    smallest = np.finfo(np.float64).tiny
    level = 20 * np.log10(np.maximum(measured, smallest) / np.maximum(simulated, smallest))
    level = np.where(heard, level, np.nan)
    return lines, np.array([np.interp(lines, frequency_hz, row) for row in level])


def _averaged(values: Floats, block: int) -> Floats:
    """Of so many samples at a time; the last few may be fewer."""
    starts = np.arange(0, values.shape[1], block)
    return np.asarray(np.add.reduceat(values, starts, axis=1) / np.diff([*starts, values.shape[1]]))


def _edges(frequency_hz: Floats) -> Floats:
    if len(frequency_hz) < 2:
        return np.repeat(frequency_hz, 2)
    middle = np.sqrt(frequency_hz[1:] * frequency_hz[:-1])
    first, last = frequency_hz[0] ** 2 / middle[0], frequency_hz[-1] ** 2 / middle[-1]
    return np.concatenate(([first], middle, [last]))
