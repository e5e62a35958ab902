"""Records at a multiple of their sampling rate, limited to the band that they have."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ...array_types import Floats

#: Samples that each end of a record is continued by, at most an eighth of it but sixteen, so that
#: the transform, which takes a record for a circle, sees neither a jump nor a kink where the ends
#: meet.
_CONTINUED, _LEAST_CONTINUED = 256, 16


@lru_cache(maxsize=64)
def continuation_taper(samples: int) -> Floats:
    """Of the continuation of a record of so many samples, from its end outwards."""
    continued = min(_CONTINUED, max(_LEAST_CONTINUED, samples // 8))
    return np.asarray(0.5 * (1 + np.cos(np.pi * np.arange(1, continued + 1) / (continued + 1))))


def extended(records: Floats) -> Floats:
    """Records (k, n) continued to an even length that is quick to transform: point symmetric about
    the last and the first sample, under a taper that ends at 0."""
    from scipy.fft import next_fast_len

    samples = records.shape[-1]
    taper = continuation_taper(samples)
    continued = taper.size
    length = next_fast_len(samples + 2 * continued, real=True)
    while length % 2:
        length = next_fast_len(length + 1, real=True)
    steps = np.arange(1, continued + 1)
    mirrored = np.minimum(steps, samples - 1)
    whole = np.zeros((*records.shape[:-1], length))
    whole[..., :samples] = records
    whole[..., samples : samples + continued] = (
        2 * records[..., -1:] - records[..., samples - 1 - mirrored]
    ) * taper
    whole[..., length - steps] = (2 * records[..., :1] - records[..., mirrored]) * taper
    return whole


def upsampled(records: Floats, factor: int) -> Floats:
    """(k, n) to (k, (n - 1) factor + 1), each old sample kept: zeros put between the samples and
    the images removed.

    Exact for a record without content above half the sampling rate that begins and ends at rest.
    """
    if factor == 1:
        return records
    from scipy.fft import irfft, rfft

    # Shifted by parts of a sample, one after the other: one long transform takes two to three times
    # as long.
    whole, samples = extended(records), records.shape[-1]
    spectrum = rfft(whole)
    shift = np.exp(2j * np.pi / (factor * whole.shape[-1]) * np.arange(spectrum.shape[-1]))
    fine = np.empty((len(records), samples, factor))
    fine[..., 0] = records
    for part in range(1, factor):
        spectrum *= shift
        fine[..., part] = irfft(spectrum, whole.shape[-1])[..., :samples]
    return np.ascontiguousarray(fine.reshape(len(records), -1)[..., : (samples - 1) * factor + 1])
