"""Sampling: is the highest line slow enough for the sampling rate?"""

from __future__ import annotations

from ..channel import Channel
from ..srs.spectrum import Spectrum
from .base import Finding

#: Ten samples a cycle leave 8 % open, by the spectrum's own measure of it (`Spectrum.sampling_error`).
LIMIT = 0.1


def check_sampling(channel: Channel, spectrum: Spectrum) -> list[Finding]:
    """At most one `warning`: the share of a peak that sampling may hide, largest over the lines, passes 10 %."""
    worst = int(spectrum.sampling_error.argmax())
    share = float(spectrum.sampling_error[worst])
    if share <= LIMIT:
        return []
    trusted = spectrum.frequency_hz[spectrum.sampling_error <= LIMIT]
    advice = f"trust lines up to {trusted.max():.4g} Hz" if trusted.size else "trust no line"
    worst_hz = float(spectrum.frequency_hz[worst])
    message = (
        f"{channel.sampling_rate_hz:g} Hz may hide {share:.0%} of a peak at {worst_hz:.4g} Hz: {advice}, or have the "
        "record resampled (--resample)"
    )
    evidence = {"hidden_share": share, "limit_share": LIMIT, "frequency_hz": worst_hz}
    return [Finding("sampling", "warning", message, channel.name, evidence)]
