"""Fig. 4.2: the acceleration of the hammer, raw and freed of the hammer's own dynamics."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from pyroshock.app.figures.matplotlib_renderer import new_figure
from pyroshock.ingest.extraction.deconvolution import clean_acceleration
from pyroshock.ingest.extraction.pulses import extract_pulses
from pyroshock.ingest.extraction.settings import ExtractionSettings

from .picture import MEASURED, MODEL
from .virtual_campaign import HammerCampaign

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Floats = NDArray[np.float64]

#: Samples before a contact that its window begins with, and of the window: 80 ms, in which the head
#: has rung down.
BEFORE, SEGMENT = 64, 4096
HIT = 0
_SHOWN_MS = 2.5


def cleaned(campaign: HammerCampaign, test: int) -> tuple[Floats, Floats, Floats]:
    """Time (s, from the contact's first sample), raw and cleaned acceleration (m/s2, hits x n) of a
    test."""
    channels, settings = campaign.channels(test), ExtractionSettings()
    force, acceleration = channels["force"], channels["acceleration_hammer"]
    rate = force.sampling_rate_hz
    pulses = extract_pulses(force.si, rate, settings, expected=campaign.hits)
    starts = np.array([pulse.contact.first - BEFORE for pulse in pulses])
    band_hz = (settings.rigid_from_hz, settings.rigid_to_hz)
    clean = clean_acceleration(
        acceleration.si, force.si, rate, starts, segment=SEGMENT, band_hz=band_hz
    )
    raw = acceleration.si[starts[:, None] + np.arange(SEGMENT)]
    return (np.arange(SEGMENT) - BEFORE) / rate, raw, clean


def draw(campaign: HammerCampaign) -> Figure:
    """The first hit of the first test with a tip of aluminium."""
    time, raw, clean = cleaned(campaign, campaign.tests_with("aluminum")[0])
    figure = new_figure(7.0, 4.0)
    axes = figure.subplots()
    axes.plot(time * 1e3, raw[HIT], color=MEASURED, lw=1, label="raw")
    axes.plot(time * 1e3, clean[HIT], color=MODEL, lw=1.4, label="deconvolved, eq. 4.2")
    axes.set_xlim(-0.3, _SHOWN_MS)
    axes.set_xlabel("time since first contact (ms)")
    axes.set_ylabel("acceleration of the hammer (m/s²)")
    axes.set_title(campaign.note, fontsize=9)
    axes.legend(frameon=False)
    return figure
