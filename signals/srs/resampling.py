"""Records at a multiple of their sampling rate, limited to the band that they have."""

from __future__ import annotations

import numpy as np

from ...array_types import Floats

#: Samples that each end of a record is continued by, at most an eighth of it but sixteen, so that the transform, which
#: takes a record for a circle, sees neither a jump nor a kink where the ends meet.
_CONTINUED, _LEAST_CONTINUED = 256, 16


def extended(records: Floats) -> Floats:
    """Records (k, n) continued to an even length that is quick to transform: point symmetric about the last and the
    first sample, under a taper that ends at 0."""
    from scipy.fft import next_fast_len

    samples = records.shape[-1]
    continued = min(_CONTINUED, max(_LEAST_CONTINUED, samples // 8))
    length = next_fast_len(samples + 2 * continued, real=True)
    while length % 2:
        length = next_fast_len(length + 1, real=True)
    steps = np.arange(1, continued + 1)
    taper = 0.5 * (1 + np.cos(np.pi * steps / (continued + 1)))
    mirrored = np.minimum(steps, samples - 1)
    whole = np.zeros((*records.shape[:-1], length))
    whole[..., :samples] = records
    whole[..., samples : samples + continued] = (2 * records[..., -1:] - records[..., samples - 1 - mirrored]) * taper
    whole[..., length - steps] = (2 * records[..., :1] - records[..., mirrored]) * taper
    return whole


def upsampled(records: Floats, factor: int) -> Floats:
    """(k, n) to (k, (n - 1) factor + 1), each old sample kept: zeros put between the samples and the images removed.

    Exact for a record without content above half the sampling rate that begins and ends at rest.
    """
    if factor == 1:
        return records
    from scipy.fft import irfft, rfft

    whole = extended(records)
    spectrum = rfft(whole)
    spectrum[..., -1] *= 0.5  # the line at half the sampling rate stands for two of the finer record's
    fine = irfft(spectrum, factor * whole.shape[-1])
    fine *= factor
    return np.ascontiguousarray(fine[..., : (records.shape[-1] - 1) * factor + 1])
