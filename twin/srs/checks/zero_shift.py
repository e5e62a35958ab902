"""Zero shift: the sensor rests at another level after the shock than before."""

from __future__ import annotations

import numpy as np

from ....signals.srs.record import Spectrum
from .base import MIN_ERRORS, Finding, Record, level

#: A step b drives a slow oscillator to 2 b: 1 % of the peak. Two decades below its knee a spectrum that rises by 6 dB
#: an octave is 40 dB below its plateau, so that from here on it shows the offset.
LIMIT = 0.005
#: An elastic suspension can turn the velocity v that a shock gave into -v; a ramp beyond that is not the structure's.
MAX_RAMP = 2.0


def check_zero_shift(record: Record, _: Spectrum) -> Finding | None:
    """Needs a level before and one after. Offset in shares of the peak; Bateman, Himelblau and Merritt, "Validation of
    Pyroshock Data" (2012): it shows as a ramp of the velocity, which tells it from what the structure does."""
    if record.before.size == 0 or record.after.size == 0 or record.peak_m_s2 == 0.0:
        return None
    (before, error_before), (after, error_after) = level(record.before), level(record.after)
    shift = after - before
    value = abs(shift) / record.peak_m_s2
    if abs(shift) < MIN_ERRORS * float(np.hypot(error_before, error_after)) or value < LIMIT:
        return None
    ramp = shift * (record.acceleration.size - record.shock[0]) / record.sampling_rate_hz
    if abs(ramp) < MAX_RAMP * _velocity_without(record, before, after):
        return None
    message = (
        f"rests {shift:.4g} m/s2 off after the shock, which integrates to {ramp:.3g} m/s: the spectrum's low lines are "
        "the offset's; mend the baseline or do not use them"
    )
    return Finding("zero-shift", value, LIMIT, "", message)


def _velocity_without(record: Record, before: float, after: float) -> float:
    """Largest velocity of the shock with its offset gone, m/s: the ramp must not hide itself.

    Nobody knows when in the shock the offset came; the smaller of both guesses is the structure's.
    """
    first, last = record.shock
    x = record.acceleration[first : last + 1]
    return min(float(np.abs(np.cumsum(x - rest)).max()) for rest in (before, after)) / record.sampling_rate_hz
