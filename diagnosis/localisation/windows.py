"""When, and at which frequencies, the records differ beyond chance."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_opening, find_objects, label

from ...array_types import Floats, Rows
from ..verdict import FrequencyBand, TimeWindow

#: Up to which part of its peak a pulse is said to agree, and by how many dB a spectrum.
PULSE_TOLERANCE, SPECTRUM_TOLERANCE_DB = 0.03, 0.5
#: Down to which part of the impulse a pulse's amplitude spectrum is looked at.
_AUDIBLE = 0.1
_LINES_AN_OCTAVE = 6
#: Samples that a record is brought to by averaging: shorter stretches are not told apart anyway.
_SAMPLES = 256
FLIPS = 499
#: Chance makes a stretch in this share of records without a gap.
_LEVEL = 0.05
#: Shortest stretch that is looked for, in samples.
_SHORTEST = 3
#: A stretch ends where the gap falls below this part of its rms.
_EDGE = 0.35


def time_windows(
    time_s: Floats,
    measured: Floats,
    simulated: Floats,
    configuration: Rows,
    channel: str,
    rng: np.random.Generator,
) -> tuple[TimeWindow, ...]:
    """Windows in which aligned records (R, p) differ by more than 3 % of the measured peak, beyond
    chance."""
    peak = np.nanmax(np.abs(measured), axis=1, keepdims=True, initial=1e-300)
    block = -(-len(time_s) // _SAMPLES)
    starts = np.arange(0, len(time_s), block)
    averages = np.add.reduceat((measured - simulated) / peak, starts, axis=1) / np.diff(
        [*starts, len(time_s)]
    )
    edges = time_s[[*starts, len(time_s) - 1]]
    stretches = spans(averages, configuration, PULSE_TOLERANCE, rng)
    return tuple(
        TimeWindow(channel, float(edges[first]), float(edges[last + 1]))
        for first, last in stretches
    )


def frequency_bands(
    frequency_hz: Floats,
    residual_db: Floats,
    configuration: Rows,
    channel: str,
    rng: np.random.Generator,
) -> tuple[FrequencyBand, ...]:
    """Bands in which levels (R, lines), measured less simulated, differ by more than 0.5 dB: of a
    shock response spectrum, or of a force. A line stands for the band up to the geometric middle of
    it and its neighbour.
    """
    edges = np.repeat(frequency_hz, 2)
    if len(frequency_hz) > 1:
        middle = np.sqrt(frequency_hz[1:] * frequency_hz[:-1])
        edges = np.array(
            [frequency_hz[0] ** 2 / middle[0], *middle, frequency_hz[-1] ** 2 / middle[-1]]
        )
    stretches = spans(residual_db, configuration, SPECTRUM_TOLERANCE_DB, rng)
    return tuple(
        FrequencyBand(channel, float(edges[first]), float(edges[last + 1]))
        for first, last in stretches
    )


def amplitude_residual_db(
    frequency_hz: Floats, measured: Floats, simulated: Floats
) -> tuple[Floats, Floats]:
    """Lines (m,), six an octave, and measured less simulated (R, m) in dB of amplitude spectra (R,
    n) of pulses.

    `frequency_hz` (n,) is even and begins at 0. NaN for a run from where its measured spectrum
    first falls below a tenth of its impulse: beyond, zeros of both spectra stand beside each other.
    Short pulses go further than long ones.
    """
    audible = np.logical_and.accumulate(measured >= _AUDIBLE * measured[:, :1], axis=1)
    last = int(audible.any(axis=0).sum()) - 1
    if last < 2:
        return np.empty(0), np.empty((len(measured), 0))
    first_hz = 0.5 * frequency_hz[1]
    octaves = np.log2(frequency_hz[last] / first_hz)
    lines = first_hz * 2.0 ** (np.arange(int(octaves * _LINES_AN_OCTAVE) + 1) / _LINES_AN_OCTAVE)
    smallest = np.finfo(np.float64).tiny
    level = 20 * np.log10(np.maximum(measured, smallest) / np.maximum(simulated, smallest))
    level = np.where(audible, level, np.nan)
    return lines, np.array([np.interp(lines, frequency_hz, row) for row in level])


def spans(
    residual: Floats,
    configuration: Rows,
    tolerance: float,
    rng: np.random.Generator,
    flips: int = FLIPS,
) -> tuple[tuple[int, int], ...]:
    """First and last sample of each stretch, in order. Residuals (R, p) in the unit of `tolerance`,
    NaN allowed.

    A window's statistic is the product of residuals of two repetitions, summed over its samples,
    over pairs and over configurations: without a gap its mean is zero whatever the scatter is.
    Flipping the signs of whole runs says how large the largest over all windows gets then (five per
    cent family-wise). The strongest window is taken out and the rest searched again, as long as one
    is beyond chance and its gap beyond the tolerance. Windows that touch are one. Where no
    configuration was repeated chance cannot be told from a gap, and the tolerance alone decides.
    """
    recorded = np.isfinite(residual)
    values = np.where(recorded, residual, 0.0)
    member = np.eye(int(configuration.max(initial=-1)) + 1)[:, configuration]
    pairs = _products(recorded.astype(np.float64), member)
    if not pairs.any():
        beyond = np.sqrt(np.mean(values**2, axis=0)) > tolerance
        return _stretches(binary_opening(beyond, np.ones(_SHORTEST, dtype=bool)))
    pairs = np.maximum(pairs, 1.0)
    product = _products(values, member) / pairs
    signs = rng.choice([-1.0, 1.0], size=(flips, len(values)))
    chance = np.array([_products(values * sign[:, None], member) for sign in signs]) / pairs
    windows = _dyadic_windows(values.shape[1])
    taken = np.zeros(values.shape[1], dtype=bool)
    while (window := _strongest(product, chance, windows, tolerance)) is not None:
        taken |= _trimmed(window, product, tolerance)
        windows = windows * ~taken
    return _stretches(taken)


def _dyadic_windows(samples: int) -> Floats:
    """(W, p) of 0 and 1: all halves, quarters ... of the record, and as many in between."""
    places = np.arange(samples)
    lengths = [samples >> halvings for halvings in range(samples.bit_length())]
    windows = [
        (places >= start) & (places < start + length)
        for length in lengths
        if length >= min(_SHORTEST, samples)
        for start in range(0, samples - length + 1, max(1, length // 2))
    ]
    return np.array(windows, dtype=np.float64)


def _products(values: Floats, member: Floats) -> Floats:
    """(p,): products of different runs of one configuration, summed."""
    return np.asarray(((member @ values) ** 2).sum(axis=0) - (values**2).sum(axis=0))


def _strongest(
    product: Floats, chance: Floats, windows: Floats, tolerance: float
) -> NDArray[np.bool_] | None:
    """The window (p,) whose statistic is largest beside its scatter by chance."""
    windows = windows[windows.sum(axis=1) >= min(_SHORTEST, windows.shape[1])]
    if not len(windows):
        return None
    by_chance = chance @ windows.T
    scatter = np.maximum(by_chance.std(axis=0), 1e-300)
    observed = windows @ product / scatter
    bound = np.quantile((by_chance / scatter).max(axis=1), 1 - _LEVEL)
    large = windows @ product > tolerance**2 * windows.sum(axis=1)
    observed = np.where(large & (observed > bound), observed, -np.inf)
    strongest = int(np.argmax(observed))
    return windows[strongest] > 0 if np.isfinite(observed[strongest]) else None


def _trimmed(window: NDArray[np.bool_], product: Floats, tolerance: float) -> NDArray[np.bool_]:
    """A window (p,) without its ends where there is hardly a gap; at least one sample remains, so
    that every search takes something out."""
    gap = np.sqrt(np.maximum(product, 0.0))
    least = max(tolerance, _EDGE * float(np.sqrt(np.mean(gap[window] ** 2))))
    large = window & (gap >= min(least, gap[window].max()))
    return window & np.maximum.accumulate(large) & np.maximum.accumulate(large[::-1])[::-1]


def _stretches(inside: NDArray[np.bool_]) -> tuple[tuple[int, int], ...]:
    """First and last sample of each."""
    return tuple((samples.start, samples.stop - 1) for (samples,) in find_objects(label(inside)[0]))
