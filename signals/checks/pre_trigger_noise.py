"""Noise before the first contact: what the record shows while nothing happens."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..channel import Channel
from .base import Contact, Finding, Severity
from .levels import ShockSpan, finite_samples, robust_sigma, shock_span

#: What rests before a shock. Pressure and temperature need not.
QUANTITIES = ("force", "acceleration", "velocity", "strain")
#: A MAD of sixteen samples is off by 29 % (one standard error): enough to compare with limits a
#: decade apart.
MIN_SAMPLES = 16
#: At 2 % of the peak three sigma are 6 %: the level at 10 % of the peak, at which pulse widths are
#: read, drowns.
WARNING_SHARE = 0.02
#: Above this three sigma pass the 0.5 % of the peak that bounds a contact (thesis, section 4.1).
NOTE_SHARE = 0.005 / 3.0
#: The stretch just before the shock is what the shock was recorded in; a second holds 50 periods of
#: the mains.
MAX_STRETCH_S = 1.0
MAINS_HZ = (50.0, 60.0)
#: A hum is told from drift by three periods or more, and named when it carries most of the
#: variance.
MIN_MAINS_PERIODS = 3.0
HUM_SHARE = 0.5
#: The hum is fitted on block means of about this rate: a few hundred numbers instead of 100,000.
HUM_RATE_HZ = 1000.0


def check_pre_trigger_noise(channel: Channel, contacts: tuple[Contact, ...]) -> list[Finding]:
    """At most one finding: `note` when there is nothing before the contact or noise passes 0.17 %,
    `warning` from 2 %.

    Compares with the peak of the channel. Force, acceleration, velocity and strain.
    """
    if channel.quantity not in QUANTITIES:
        return []
    x = finite_samples(channel)
    span = shock_span(channel, contacts)
    if span is None:
        return []
    longest = max(MIN_SAMPLES, round(MAX_STRETCH_S * channel.sampling_rate_hz))
    quiet = x[max(0, span.first - longest) : span.first]
    if quiet.size < MIN_SAMPLES:
        return [_nothing_before(channel, quiet.size)]
    return _judge(channel, quiet, span)


def _nothing_before(channel: Channel, samples: int) -> Finding:
    evidence = {"samples": samples, "limit_samples": MIN_SAMPLES}
    message = (
        f"{samples} samples before the first contact (limit {MIN_SAMPLES}): noise "
        f"and level at rest are unknown"
    )
    return Finding("pre-trigger-noise", "note", message, channel.name, evidence)


def _judge(channel: Channel, quiet: NDArray[np.float64], span: ShockSpan) -> list[Finding]:
    sigma = robust_sigma(quiet)
    share = sigma / span.peak
    if share < NOTE_SHARE:
        return []
    hum_hz, hum_share = _hum(quiet, channel.sampling_rate_hz)
    evidence = {
        "sigma": sigma,
        "peak_to_peak": float(np.ptp(quiet)),
        "peak": span.peak,
        "unit": channel.si_unit,
        "sigma_to_peak": share,
        "samples": int(quiet.size),
        "mains_hz": hum_hz,
        "mains_variance_share": hum_share,
    }
    hum = f", mostly mains hum at {hum_hz:g} Hz" if hum_hz is not None else ""
    message = (
        f"noise of {sigma:.3g} {channel.si_unit} before the shock, {share:.2%} of its peak{hum}"
    )
    severity: Severity = "warning" if share >= WARNING_SHARE else "note"
    return [Finding("pre-trigger-noise", severity, message, channel.name, evidence)]


def _hum(quiet: NDArray[np.float64], rate_hz: float) -> tuple[float | None, float]:
    """The mains frequency that carries most of the variance (None below half of it), and its
    share."""
    block = max(1, int(rate_hz / HUM_RATE_HZ))
    count = quiet.size // block
    means = quiet[: count * block].reshape(count, block).mean(axis=1)
    variance = float(quiet.var())
    if variance == 0.0 or count * block / rate_hz < MIN_MAINS_PERIODS / min(MAINS_HZ):
        return None, 0.0
    phase = 2j * np.pi * block / rate_hz * np.arange(count)
    swing = means - means.mean()
    # Amplitude of each by correlation; A^2 / 2 is its variance.
    share = {
        hz: 2.0 * abs(np.exp(-hz * phase) @ swing) ** 2 / count**2 / variance for hz in MAINS_HZ
    }
    strongest = max(share, key=lambda hz: share[hz])
    return (strongest if share[strongest] >= HUM_SHARE else None), float(share[strongest])
