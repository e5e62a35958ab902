"""Balance: positive and negative spectrum at low frequencies."""

from __future__ import annotations

import numpy as np

from ..channel import Channel
from ..srs.spectrum import Spectrum
from .base import Finding

#: A slow oscillator rings freely after a short shock: at Q = 10 its second swing is 1.4 dB below
#: its first.
LIMIT_DB = 6.0
#: Slow lines: within two octaves of the lowest ...
OCTAVES = 2.0
#: ... and this far below the line of the largest response, where it is the shock's own form that
#: counts.
BELOW_KNEE = 4.0


def check_balance(channel: Channel, spectrum: Spectrum) -> list[Finding]:
    """At most one `warning`: the median over the slow lines of 20 log10(positive / negative) is 6
    dB or more.

    Ideally both are about equal (T. Irvine, "An Introduction to the Shock Response Spectrum", rev.
    S, 2012, who judges a pulse by it): an offset pushes one way only. Nothing is said where there
    is no slow line.
    """
    frequency = spectrum.frequency_hz
    knee = frequency[int(spectrum.maximax.argmax())]
    slow = (frequency <= frequency.min() * 2**OCTAVES) & (frequency <= knee / BELOW_KNEE)
    slow &= (spectrum.positive > 0) & (spectrum.negative > 0)
    if not np.any(slow):
        return []
    ratio_db = float(np.median(20 * np.log10(spectrum.positive[slow] / spectrum.negative[slow])))
    if abs(ratio_db) < LIMIT_DB:
        return []
    higher = "positive" if ratio_db > 0 else "negative"
    up_to_hz = float(frequency[slow].max())
    message = (
        f"the {higher} spectrum is {abs(ratio_db):.1f} dB higher up to "
        f"{up_to_hz:.4g} Hz: something pushed one way all "
        "the time, mostly a zero shift; do not use these lines before it is mended"
    )
    evidence = {"ratio_db": ratio_db, "limit_db": LIMIT_DB, "up_to_hz": up_to_hz}
    return [Finding("balance", "warning", message, channel.name, evidence)]
