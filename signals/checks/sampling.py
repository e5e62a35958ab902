"""Sampling: is the record fast enough for its content and for the lines of its spectrum?"""

from __future__ import annotations

import numpy as np

from ..channel import Channel
from ..srs.spectrum import Spectrum
from .base import Finding

#: What calibration and mounting leave open of an accelerometer at these frequencies: 0.8 dB.
LIMIT = 0.1
#: Of the peak of a record: hammer hits on a structure that rings up to there have up to a tenth
#: close to half the sampling rate behind a converter's steep filter, and shocks that were folded
#: have more.
HIGH_SHARE = 0.2


def check_sampling(channel: Channel, spectrum: Spectrum) -> list[Finding]:
    """At most one `warning`: of a line more than 10 % may be hidden by sampling.

    Either it was not resampled as its content requires, or 20 % of the shock lie close to half the
    sampling rate, where nothing tells them from content above. What lies there all the time is
    noise, which the check of the noise floor judges.
    """
    folded = float(spectrum.high_share) >= HIGH_SHARE
    error = spectrum.sampling_error if folded else spectrum.hidden_error
    worst = int(error.argmax())
    if error[worst] <= LIMIT:
        return []
    good = spectrum.frequency_hz[error <= LIMIT]
    if not good.size:
        advice = "trust no line"
    elif good.max() < spectrum.frequency_hz[error > LIMIT].min():
        advice = f"trust lines up to {good.max():.4g} Hz"
    else:
        advice = f"trust {good.size} of {error.size} lines"
    worst_hz, half_hz = float(spectrum.frequency_hz[worst]), channel.sampling_rate_hz / 2
    share = f"{error[worst]:.0%} of the line" if np.isfinite(error[worst]) else "the whole line"
    if folded:
        message = (
            f"{spectrum.high_share:.0%} of the peak lie close to {half_hz:.4g} Hz, half the "
            "sampling rate, and cannot be told from content above it, which may have changed "
            f"{share} at {worst_hz:.4g} Hz (limit {LIMIT:.0%}): record faster, or with an "
            "anti-alias filter"
        )
    else:
        message = (
            f"{channel.sampling_rate_hz:g} Hz may hide {share} at {worst_hz:.4g} Hz (limit "
            f"{LIMIT:.0%}): let the record be resampled (without --no-resample), or record faster"
        )
    evidence = {
        "hidden_share": _finite(float(error[worst])),
        "limit_share": LIMIT,
        "frequency_hz": worst_hz,
        "close_to_half_rate_share": float(spectrum.high_share),
    }
    return [Finding("sampling", "warning", f"{message}; {advice}", channel.name, evidence)]


def _finite(share: float) -> float | None:
    """None for a share without a bound: evidence is JSON."""
    return share if np.isfinite(share) else None
