"""Maximax spectra of what rings down after a blow, from no more of each record than a line
takes."""

from __future__ import annotations

import math

import numpy as np

from ...array_types import Floats

#: Lines that are run together, and cycles of the lowest of them that are waited for: of a free
#: plate of aluminium with damping of 0.2 %, under pulses of 0.15 to 1.5 ms, 30 cycles lose 0.05 dB
#: at worst, 20 cycles 2 dB.
BLOCK, CYCLES = 16, 30.0
#: Pulses up to here are waited for with them.
_PULSE_S = 5e-3
#: Sampling may hide this share of a line, 0.4 dB: the 90 % band of a predicted line is several dB
#: wide, and a search computes some ten thousand of them.
_RESAMPLED_WITHIN = 0.05


def ringing_spectra(
    acceleration: Floats, sampling_rate_hz: float, frequency_hz: Floats, q: float, pulse_s: float
) -> Floats:
    """Maximax (..., f) of records (..., n) that begin with a pulse of at most `pulse_s` and ring
    down after it."""
    from ...signals.srs.spectrum import shock_response_spectrum

    out = np.empty((*acceleration.shape[:-1], frequency_hz.size))
    for first in range(0, frequency_hz.size, BLOCK):
        lines = frequency_hz[first : first + BLOCK]
        waited = CYCLES / float(lines.min()) + max(pulse_s, _PULSE_S)
        record = acceleration[..., : math.ceil(waited * sampling_rate_hz)]
        spectrum = shock_response_spectrum(
            record, sampling_rate_hz, lines, q=q, resample_within=_RESAMPLED_WITHIN
        )
        out[..., first : first + BLOCK] = spectrum.maximax
    return out
