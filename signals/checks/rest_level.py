"""Rest level: an accelerometer that does not rest at zero before the shock, or after it where
nothing lies before."""

from __future__ import annotations

import math

import numpy as np

from ..channel import Channel, on_impactor
from .base import Contact, Finding, Severity
from .levels import baseline, block_mean, finite_samples, rest_after, rest_before, shock_span

#: A constant b is b in every line of a shock spectrum, and two decades below its knee the spectrum
#: of most shocks has come down to that (see the check of zero shifts): worth a note.
NOTE_SHARE = 0.005
#: 5 % of the peak stand above all slow lines of most shocks.
WARNING_SHARE = 0.05
#: A record whose median is below this share of its swing rests near zero for most of the time; zero
#: shifts of the rest are found by the check of that name.
MEDIAN_SHARE = NOTE_SHARE / 4
#: From a fifth of the peak on, amplifier or calibration is at fault: what gave the offset gave the
#: peak as well.
REJECT_SHARE = 0.2
#: A sensor that responds to DC rests at up to one gravity by the way it stands; a tenth more is its
#: calibration.
GRAVITY_M_S2 = 1.1 * 9.80665
#: Standard errors that make a level: with ten blocks exceeded by chance once in 1350 (Student's t,
#: nine degrees).
MIN_ERRORS = 5.0


def check_rest_level(channel: Channel, contacts: tuple[Contact, ...]) -> list[Finding]:
    """At most one finding, of an acceleration that is not of what moves on purpose.

    `note` from 0.5 % of the peak and where gravity explains it, `warning` from 5 %, `reject` from
    20 %. The peak is counted from rest.
    """
    if channel.quantity != "acceleration" or on_impactor(channel.sensor.position):
        return []
    x = finite_samples(channel)
    if x.size == 0 or abs(baseline(x)) < MEDIAN_SHARE * float(np.ptp(x)):
        return []
    span = shock_span(channel, contacts)
    if span is None:
        return []
    before, after = rest_before(x, span), rest_after(x, span)
    where, quiet = ("before", before) if before.size else ("after", after)
    if quiet.size == 0:
        return []
    level, error = block_mean(quiet)
    peak = float(np.abs(x[span.first : span.last + 1] - level).max())
    share = abs(level) / peak if peak > 0.0 else math.inf
    if share < NOTE_SHARE or abs(level) < MIN_ERRORS * error:
        return []
    gravity = abs(level) <= GRAVITY_M_S2
    severity: Severity = (
        "reject" if share >= REJECT_SHARE else "warning" if share >= WARNING_SHARE else "note"
    )
    if gravity:
        severity = "note"
    evidence = {
        f"{where}_m_s2": level,
        "standard_error_m_s2": error,
        "peak_m_s2": peak,
        "peak_share": share,
        "limit_share": NOTE_SHARE,
        "could_be_gravity": gravity,
    }
    cause = (
        "which gravity explains"
        if gravity
        else f"limit {NOTE_SHARE:.1%}; take it off, or look at the amplifier"
    )
    message = f"rests at {level:.4g} m/s2 {where} the shock, {share:.1%} of its peak ({cause})"
    return [Finding("rest-level", severity, message, channel.name, evidence)]
