"""Noise floor: from which line on does the spectrum show the shock, not the noise?"""

from __future__ import annotations

import numpy as np

from ....signals.srs.record import Spectrum
from .base import Finding, Floats, Record

#: Noise 6 dB below adds at most 3.5 dB to a line.
LIMIT_DB = 6.0


def check_noise_floor(record: Record, spectrum: Spectrum) -> Finding | None:
    """Lowest line, Hz, from which on all up to the largest line stand 6 dB above the spectrum of the noise before the
    shock. Lines above the largest one that do not are told, too.

    Lines slower than one period in the time before the shock are left out: nothing is known of the noise there. None
    without 16 samples before the shock.
    """
    if record.before.size == 0 or np.ptp(record.before) == 0.0:
        return None
    told = spectrum.frequency_hz >= record.sampling_rate_hz / record.before.size
    low = told & (spectrum.maximax < 10 ** (LIMIT_DB / 20) * _noise(record, spectrum))
    if not np.any(low):
        return None
    lines, largest = spectrum.frequency_hz, spectrum.frequency_hz[int(spectrum.maximax.argmax())]
    lowest = float(np.min(lines[told & (lines > np.max(lines[low & (lines <= largest)], initial=0.0))], initial=np.inf))
    highest = float(np.max(lines[lines < np.min(lines[low & (lines > largest)], initial=np.inf)]))
    below_peak = 20 * np.log10(record.peak_m_s2 / record.before.std())
    good = f"use lines from {lowest:.4g} to {highest:.4g} Hz only" if lowest <= highest else "use no line"
    message = (
        f"the noise before the shock, {below_peak:.0f} dB below its peak, is less than {LIMIT_DB:g} dB below the "
        f"spectrum at {np.count_nonzero(low)} of {np.count_nonzero(told)} lines: {good}, or measure with less noise"
    )
    return Finding("noise-floor", min(lowest, float(lines.max())), float(lines.min()), "Hz", message)


def _noise(record: Record, spectrum: Spectrum) -> Floats:
    from ....signals.srs.spectrum import shock_response_spectrum

    quiet = record.before - record.before.mean()
    made = shock_response_spectrum(
        quiet, record.sampling_rate_hz, spectrum.frequency_hz, damping_ratio=spectrum.damping_ratio
    )
    return np.asarray(made.maximax)
