"""Few samples: contacts too short for the sampling rate."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ..channel import Channel
from .base import Contact, Finding, Severity
from .levels import baseline, finite_samples

#: The thesis (sections 2.2.2 and 4.1) counts fewer than ten as few; the spline still rebuilt those
#: within 0.5 %.
FEW_SAMPLES = 10
#: A half sine of N samples misses its peak by up to 1 - cos(pi / 2N): 1.2 % at ten, 4.9 % at five.
#: With fewer than five the peak is worse than the few per cent to which a force transducer is
#: calibrated.
TOO_FEW_SAMPLES = 5
#: A sample belongs to the contact above this share of its peak (thesis, section 4.1).
CONTACT_SHARE = 0.005


def check_few_samples(channel: Channel, contacts: tuple[Contact, ...]) -> list[Finding]:
    """A `note` per contact with less than ten samples above 0.5 % of its peak, a `warning` below
    five. Force only."""
    if channel.quantity != "force":
        return []
    x = finite_samples(channel)
    rest = baseline(x)
    counts = [_samples_in(x - rest, contact) for contact in contacts]
    return [
        _finding(channel, count, index) for index, count in enumerate(counts) if count < FEW_SAMPLES
    ]


def _samples_in(force: NDArray[np.float64], contact: Contact) -> int:
    """Samples of `force` (n,), above rest and of either sign, that the contact lasts; the peak is
    one of them."""
    within = force[contact.first : contact.last + 1] * np.sign(force[contact.peak])
    return max(1, int(np.count_nonzero(within > CONTACT_SHARE * abs(force[contact.peak]))))


def _finding(channel: Channel, samples: int, index: int) -> Finding:
    missed = 1.0 - math.cos(math.pi / (2 * samples))
    evidence = {
        "samples": samples,
        "limit_samples": FEW_SAMPLES,
        "sampling_rate_hz": float(channel.sampling_rate_hz),
        "missed_peak_share": missed,
    }
    severity: Severity = "warning" if samples < TOO_FEW_SAMPLES else "note"
    message = (
        f"{samples} samples in the contact (limit {FEW_SAMPLES}): the peak may "
        f"read {missed:.1%} low"
    )
    return Finding("few-samples", severity, message, channel.name, evidence, index)
