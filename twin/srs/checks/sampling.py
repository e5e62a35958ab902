"""Sampling: is the highest line slow enough for the sampling rate?"""

from __future__ import annotations

from ....signals.srs.record import Spectrum
from .base import Finding, Record

#: Ten samples a cycle leave 8 % open, by the twin's measure of it (`Spectrum.sampling_error`).
LIMIT = 0.1


def check_sampling(record: Record, spectrum: Spectrum) -> Finding | None:
    """The share of a peak that sampling may hide, largest over the lines."""
    worst = int(spectrum.sampling_error.argmax())
    value = float(spectrum.sampling_error[worst])
    if value <= LIMIT:
        return None
    kept = spectrum.frequency_hz[spectrum.sampling_error <= LIMIT]
    good = f"trust lines up to {kept.max():.4g} Hz" if kept.size else "trust no line"
    message = (
        f"{record.sampling_rate_hz:g} Hz may hide {value:.0%} of a peak at {spectrum.frequency_hz[worst]:.4g} Hz: "
        f"{good}, or have the record resampled (--resample)"
    )
    return Finding("sampling", value, LIMIT, "", message)
