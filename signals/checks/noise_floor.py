"""Noise floor: from which line on does the spectrum show the shock, not the noise?"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..channel import Channel
from ..srs.spectrum import Spectrum
from .base import Finding
from .levels import finite_samples, rest_before, shock_span

#: Noise 6 dB below adds at most 3.5 dB to a line.
LIMIT_DB = 6.0


def check_noise_floor(channel: Channel, spectrum: Spectrum) -> list[Finding]:
    """At most one `warning`, with the lines that can be used: those that stand 6 dB above the
    spectrum of the noise before the shock, from the largest one downwards and upwards.

    Lines slower than one period in the time before the shock are left out: nothing is known of the
    noise there. Nothing is said without 16 samples at rest before the shock.
    """
    x = finite_samples(channel)
    span = shock_span(channel, ())
    quiet = x[:0] if span is None else rest_before(x, span)
    if span is None or quiet.size == 0 or np.ptp(quiet) == 0.0:
        return []
    lines = spectrum.frequency_hz
    judged = lines >= channel.sampling_rate_hz / quiet.size
    low = judged & (
        spectrum.maximax < 10 ** (LIMIT_DB / 20) * _noise_spectrum(quiet, channel, spectrum)
    )
    if not np.any(low):
        return []
    largest = lines[int(spectrum.maximax.argmax())]
    from_hz = np.min(
        lines[judged & (lines > np.max(lines[low & (lines <= largest)], initial=0.0))],
        initial=np.inf,
    )
    to_hz = np.max(
        lines[lines < np.min(lines[low & (lines > largest)], initial=np.inf)], initial=0.0
    )
    below_peak_db = 20 * np.log10(span.peak / quiet.std())
    advice = (
        f"use lines from {from_hz:.4g} to {to_hz:.4g} Hz only"
        if from_hz <= to_hz
        else "use no line"
    )
    message = (
        f"the noise before the shock, {below_peak_db:.0f} dB below its peak, is less than "
        f"{LIMIT_DB:g} dB below the spectrum at {np.count_nonzero(low)} of "
        f"{np.count_nonzero(judged)} lines: {advice}, or measure with less noise"
    )
    evidence = {
        "from_hz": float(from_hz) if from_hz <= to_hz else None,
        "to_hz": float(to_hz) if from_hz <= to_hz else None,
        "noise_below_peak_db": float(below_peak_db),
        "limit_db": LIMIT_DB,
    }
    return [Finding("noise-floor", "warning", message, channel.name, evidence)]


def _noise_spectrum(
    quiet: NDArray[np.float64], channel: Channel, spectrum: Spectrum
) -> NDArray[np.float64]:
    from ..srs.spectrum import shock_response_spectrum

    noise = quiet - quiet.mean()
    rate_hz, damping = channel.sampling_rate_hz, spectrum.damping_ratio
    return shock_response_spectrum(
        noise, rate_hz, spectrum.frequency_hz, damping_ratio=damping, resample_within=None
    ).maximax
