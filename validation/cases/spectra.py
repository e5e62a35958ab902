"""Shock response spectra of the bench's own: the ramp-invariant oscillator of Smallwood (1981), maximax."""

from __future__ import annotations

import numpy as np

from ...array_types import Floats

QUALITY = 10.0


def third_octaves(low_hz: float, high_hz: float) -> Floats:
    """Centres of the third octaves between two frequencies."""
    first, last = np.ceil(3 * np.log2(low_hz / 1000)), np.floor(3 * np.log2(high_hz / 1000))
    return np.asarray(1000 * 2 ** (np.arange(first, last + 1) / 3))


def spectrum_db(acceleration: Floats, sampling_rate_hz: float, frequency_hz: Floats) -> Floats:
    """Absolute acceleration, maximax, Q = 10, of records (..., n): 20 lg (..., lines)."""
    from scipy.signal import lfilter

    zeta, step = 1 / (2 * QUALITY), 1 / sampling_rate_hz
    levels = []
    for omega in 2 * np.pi * frequency_hz:
        decay, turn = np.exp(-zeta * omega * step), omega * np.sqrt(1 - zeta**2) * step
        c, s = decay * np.cos(turn), decay * np.sin(turn)
        ramp = s / turn
        b = [1 - ramp, 2 * (ramp - c), decay**2 - ramp]
        levels.append(np.abs(lfilter(b, [1.0, -2 * c, decay**2], acceleration)).max(axis=-1))
    return np.asarray(20 * np.log10(np.stack(levels, axis=-1)))
