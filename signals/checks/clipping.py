"""Clipping: samples at one code at the extreme of the record, where a crest should be."""

from __future__ import annotations

import numpy as np

from ..channel import Channel
from .base import Contact, Finding, Severity
from .flat_tops import Plateaus, find_code_limit, find_plateaus, find_short_top
from .levels import channel_scale, finite_samples, runs_of

#: Samples within one code of the extreme count as at the rail (an analogue rail toggles between two
#: codes). The rest is for the rounding of values that went through a float32 or a printed number.
BAND_STEPS = 1.01


def check_clipping(channel: Channel, contacts: tuple[Contact, ...]) -> list[Finding]:
    """A finding per rail and contact with a cut top; outside of contacts one per rail. Any
    quantity.

    A cut top has three samples or more at one level; two that no crest explains; or any at the last
    code of the whole numbers that the file holds.
    """
    x = finite_samples(channel)
    if x.size == 0:
        return []
    scale = channel_scale(channel)
    findings: list[Finding] = []
    for polarity in (1, -1):
        band = BAND_STEPS * scale.step
        flat = find_plateaus(x, scale, polarity, band) or find_short_top(x, scale, polarity, band)
        # a channel may be mounted upside down, so that its gain turns codes round
        upright = polarity if channel.sensor.conversion[0] > 0 else -polarity
        ends = np.setdiff1d(find_code_limit(channel.recorded, upright), channel.placeholders.lone)
        beyond = channel.placeholders.beyond_range
        if beyond.size:  # and is at the extreme of the readings, which are bounds there
            ends = np.union1d(ends, beyond[upright * channel.recorded[beyond] > 0])
        if ends.size and flat is None and np.ptp(channel.recorded):
            flat = Plateaus(float(x[ends[0]]), runs_of(ends))
        if flat is not None:
            findings += by_contact(channel, contacts, flat, "clipping", "flat top")
    return findings


def by_contact(
    channel: Channel, contacts: tuple[Contact, ...], flat: Plateaus, check: str, what: str
) -> list[Finding]:
    """The plateaus as findings, one per contact they touch and one for those outside of all.

    `reject` within a contact, and where no contacts are known: peak, impulse and the levels that
    bound the contact are all lost. `warning` outside: the pulse is whole, but a spectrum of the
    recording is not.
    """
    findings = []
    for contact, contact_runs in flat.runs.by_contact(contacts):
        severity: Severity = "warning" if contact is None and contacts else "reject"
        evidence = {"level": flat.level, "unit": channel.si_unit, **contact_runs.evidence(channel)}
        message = (
            f"{what} of {evidence['samples']} samples at {flat.level:.6g} {channel.si_unit} "
            f"from {evidence['first_time_s']:.6g} s: the value there is only a bound"
        )
        findings.append(Finding(check, severity, message, channel.name, evidence, contact))
    return findings
