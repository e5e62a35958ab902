"""Truncation: the record ends while the structure still rings."""

from __future__ import annotations

import numpy as np

from ..channel import Channel
from .base import Contact, Finding
from .levels import finite_samples, rest_before, shock_span

#: What comes after the end can then change a line of a spectrum that still builds up by about this
#: share.
LIMIT = 0.1
#: The end: this share of the record.
END_SHARE = 0.05
#: From this share of the swing at the end on, the same swing before the shock is noise, and
#: explains it.
NOISE_SHARE = 0.5


def check_truncation(channel: Channel, contacts: tuple[Contact, ...]) -> list[Finding]:
    """At most one `note`, of an acceleration: half of its swing in the last 20th of the record is a
    tenth of the peak or more."""
    if channel.quantity != "acceleration":
        return []
    x = finite_samples(channel)
    span = shock_span(channel, contacts)
    if span is None:
        return []
    swing = float(np.ptp(x[-max(2, int(END_SHARE * x.size)) :])) / 2.0
    before = rest_before(x, span)
    if swing < LIMIT * span.peak or (
        before.size and float(np.ptp(before)) / 2.0 > NOISE_SHARE * swing
    ):
        return []
    evidence = {
        "swing_m_s2": swing,
        "peak_m_s2": span.peak,
        "peak_share": swing / span.peak,
        "limit_share": LIMIT,
    }
    message = (
        f"still swings by {swing / span.peak:.0%} of its peak at its end: a spectrum's slow lines "
        "and moments miss the rest; record longer"
    )
    return [Finding("truncation", "note", message, channel.name, evidence)]
