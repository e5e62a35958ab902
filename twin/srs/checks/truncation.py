"""Truncation: the record ends while it still rings."""

from __future__ import annotations

import numpy as np

from ....signals.srs.record import Spectrum
from .base import Finding, Record

#: What comes after the end can then change a line that still builds up by about this share.
LIMIT = 0.1
#: The end: this share of the record.
END_SHARE = 0.05
#: From this share of the swing at the end on, the same swing before the shock is noise, and explains it.
NOISE_SHARE = 0.5


def check_truncation(record: Record, _: Spectrum) -> Finding | None:
    """Half of the swing in the last 20th of the record, in shares of the peak."""
    end = record.acceleration[-max(2, int(END_SHARE * record.acceleration.size)) :]
    if record.peak_m_s2 == 0.0 or (value := float(np.ptp(end)) / 2 / record.peak_m_s2) < LIMIT:
        return None
    if record.before.size and float(np.ptp(record.before)) / 2 > NOISE_SHARE * value * record.peak_m_s2:
        return None  # it is noise that swings
    message = f"still swings by {value:.0%} of its peak at its end: slow lines and moments miss the rest; record longer"
    return Finding("truncation", value, LIMIT, "", message)
