"""Saturation: samples at the declared full scale, or a top pressed flat by an amplifier before the
converter."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..channel import Channel
from .base import Contact, Finding
from .clipping import BAND_STEPS, by_contact
from .flat_tops import Plateaus, find_plateaus
from .levels import Scale, channel_scale, finite_samples, runs_of

#: An amplifier's rail sags and carries noise, unlike the converter's one code: this share of it is
#: still "at it".
BAND_SHARE = 0.01
#: Below this a crest in so wide a band is too easily flat by noise: from five on, two merged crests
#: are told apart.
MIN_SAMPLES = 5
#: These may stay at one level for as long as they like (a tank before the valve opens, a light
#: barrier), so that the shape of a top says nothing; what has a rest and leaves it for a shock may
#: not.
PULSED = ("force", "acceleration", "velocity", "strain")
#: Their zero is a convention (273.15 K), so that a full scale as a magnitude means nothing for
#: them.
WITHOUT_RANGE = ("temperature",)


def check_saturation(channel: Channel, contacts: tuple[Contact, ...]) -> list[Finding]:
    """Findings as for clipping: against `sensor.range` where it is declared and reached, else by
    the shape of the top (the range of a sensor says nothing about the amplifier behind it). By
    shape only what rests between shocks.

    A sample at full scale is a lower bound of the truth however short it stayed there, hence the
    same severities.
    """
    x = finite_samples(channel)
    if x.size == 0:
        return []
    scale = channel_scale(channel)
    full_scale = channel.sensor.range_si
    if full_scale is not None and channel.quantity not in WITHOUT_RANGE:
        beyond = _beyond_range(channel, contacts, x, full_scale, scale.step)
        if beyond:
            return beyond
    return _pressed_flat(channel, contacts, x, scale) if channel.quantity in PULSED else []


def _beyond_range(
    channel: Channel,
    contacts: tuple[Contact, ...],
    x: NDArray[np.float64],
    full_scale: float,
    step: float,
) -> list[Finding]:
    findings: list[Finding] = []
    # The top code of a converter is one step below its full scale; a step as large as the range
    # itself is no step.
    limit = full_scale - BAND_STEPS * min(step, 0.01 * full_scale)
    for polarity, extreme in ((1.0, float(x.max())), (-1.0, float(x.min()))):
        if polarity * extreme < limit:
            continue
        flat = Plateaus(extreme, runs_of(np.flatnonzero(polarity * x >= limit)))
        findings += by_contact(
            channel,
            contacts,
            flat,
            "saturation",
            f"full scale ({full_scale:.6g} {channel.si_unit}) reached: run",
        )
    return findings


def _pressed_flat(
    channel: Channel, contacts: tuple[Contact, ...], x: NDArray[np.float64], scale: Scale
) -> list[Finding]:
    findings: list[Finding] = []
    sharp = BAND_STEPS * scale.step
    for polarity, extreme in ((1, float(x.max())), (-1, float(x.min()))):
        band = BAND_SHARE * abs(extreme - scale.rest)
        if band <= sharp or find_plateaus(x, scale, polarity, sharp) is not None:
            continue  # as sharp as the converter's own steps: that is the clipping check's finding
        flat = find_plateaus(x, scale, polarity, band, MIN_SAMPLES)
        if flat is not None:
            findings += by_contact(
                channel, contacts, flat, "saturation", "top pressed flat over a run"
            )
    return findings
