"""Few samples: contacts too short for the sampling rate."""

from __future__ import annotations

import math

from ..channel import Channel
from .base import Contact, Finding, Severity

#: The thesis (sections 2.2.2 and 4.1) counts fewer than ten as few; the spline still rebuilt those within 0.5 %.
FEW_SAMPLES = 10
#: A half sine of N samples misses its peak by up to 1 - cos(pi / 2N): 1.2 % at ten, 4.9 % at five. With fewer than
#: five the peak is worse than the few per cent to which a force transducer is calibrated.
TOO_FEW_SAMPLES = 5


def check_few_samples(channel: Channel, contacts: tuple[Contact, ...]) -> list[Finding]:
    """A `note` per contact below ten samples, a `warning` below five. Force channels only."""
    if channel.quantity != "force":
        return []
    return [
        _finding(channel, contact, index)
        for index, contact in enumerate(contacts)
        if contact.last - contact.first + 1 < FEW_SAMPLES
    ]


def _finding(channel: Channel, contact: Contact, index: int) -> Finding:
    samples = contact.last - contact.first + 1
    missed = 1.0 - math.cos(math.pi / (2 * samples))
    evidence = {
        "samples": samples,
        "limit_samples": FEW_SAMPLES,
        "sampling_rate_hz": float(channel.sampling_rate_hz),
        "missed_peak_share": missed,
    }
    severity: Severity = "warning" if samples < TOO_FEW_SAMPLES else "note"
    message = f"{samples} samples in the contact (limit {FEW_SAMPLES}): the peak may read {missed:.1%} low"
    return Finding("few-samples", severity, message, channel.name, evidence, index)
