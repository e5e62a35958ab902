"""A record at a multiple of its sampling rate, limited to the band that it has."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats

#: Zeros that keep the end of a record from ringing into its beginning: the transform takes a record for a circle.
_GUARD = 64
#: Leaves 8e-6 of an error; more only costs memory.
MOST_SAMPLES_PER_CYCLE = 1000.0


def upsampled(acceleration: Floats, factor: int) -> Floats:
    """(k, n) to (k, (n - 1) factor + 1), each old sample kept: zeros put between the samples and the images removed.

    Exact for a record without content above half the sampling rate that begins and ends at rest; a jump rings.
    """
    if factor == 1:
        return acceleration
    from scipy.fft import irfft, next_fast_len, rfft

    n = acceleration.shape[-1]
    length = next_fast_len(n + _GUARD, real=True)
    length += length % 2
    spectrum = rfft(acceleration, length)
    spectrum[..., -1] *= 0.5  # the line at half the sampling rate stands for two of the finer record's
    return np.asarray(factor * irfft(spectrum, factor * length)[..., : (n - 1) * factor + 1])


def factors(frequency_hz: Floats, sampling_rate_hz: float, samples_per_cycle: float | None) -> NDArray[np.int64]:
    """The least power of two for each line (f,) that gives it `samples_per_cycle`; 1 for None.

    Raises `ValueError` for a number that is not finite and positive.
    """
    if samples_per_cycle is None:
        return np.ones(frequency_hz.size, dtype=np.int64)
    if not 0 < samples_per_cycle <= MOST_SAMPLES_PER_CYCLE:
        raise ValueError(
            f"resample = {samples_per_cycle!r}: expected samples per cycle, above 0, up to {MOST_SAMPLES_PER_CYCLE:g}"
        )
    wanted = np.maximum(samples_per_cycle * frequency_hz / sampling_rate_hz, 1.0)
    return np.asarray(2 ** np.ceil(np.log2(wanted) - 1e-12).astype(np.int64))
