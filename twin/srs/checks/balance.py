"""Balance: positive and negative spectrum at low frequencies."""

from __future__ import annotations

import numpy as np

from ....signals.srs.record import Spectrum
from .base import Finding, Record

#: A slow oscillator rings freely after a short shock: at Q = 10 its second swing is 1.4 dB below its first.
LIMIT_DB = 6.0
#: Slow lines: within two octaves of the lowest ...
OCTAVES = 2.0
#: ... and this far below the line of the largest response, where it is the shock's own form that counts.
BELOW_KNEE = 4.0


def check_balance(_: Record, spectrum: Spectrum) -> Finding | None:
    """Median over the slow lines of 20 log10(positive / negative), absolute; none where there is no slow line.

    Ideally both are about equal (T. Irvine, "An Introduction to the Shock Response Spectrum", rev. S, 2012, who judges
    a pulse by it): an offset pushes one way only.
    """
    frequency = spectrum.frequency_hz
    knee = frequency[int(spectrum.maximax.argmax())]
    slow = (frequency <= frequency.min() * 2**OCTAVES) & (frequency <= knee / BELOW_KNEE)
    slow &= (spectrum.positive > 0) & (spectrum.negative > 0)
    if not np.any(slow):
        return None
    value = float(np.median(20 * np.log10(spectrum.positive[slow] / spectrum.negative[slow])))
    if abs(value) < LIMIT_DB:
        return None
    higher = "positive" if value > 0 else "negative"
    message = (
        f"the {higher} spectrum is {abs(value):.1f} dB higher up to {frequency[slow].max():.4g} Hz: something "
        "pushed one way all the time, mostly a zero shift; do not use these lines before it is mended"
    )
    return Finding("balance", abs(value), LIMIT_DB, "dB", message)
