"""Fig. 2.9: the force of a hit by the load cell, and computed from an accelerometer on the plate
(eq. 2.7 to 2.9)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from pyroshock.app.figures.matplotlib_renderer import new_figure
from pyroshock.ingest.extraction.deconvolution import deconvolve
from pyroshock.ingest.extraction.pulses import extract_pulses
from pyroshock.ingest.extraction.transfer_function import estimate_transfer_function

from .picture import MEASURED, MODEL
from .virtual_campaign import HammerCampaign

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Floats = NDArray[np.float64]

#: The plate rings for longer than 0.5 s, which the exponential weight accounts for.
HIT = 0
BEFORE, SEGMENT, END_WEIGHT = 64, 24_576, 1e-3
_SHOWN_S = 3e-3


def forces(campaign: HammerCampaign, test: int, hit: int = HIT) -> tuple[Floats, Floats, Floats]:
    """Time (s, from the contact's first sample), measured and computed force (N) of a hit.

    The transfer function (eq. 2.7) is that of the other hits: by its own the measured force would
    come back whatever the accelerometer saw. Divided by it, an acceleration is a force already (eq.
    2.9's factor is for another tf).
    """
    channels = campaign.channels(test)
    force, acceleration = channels["force"], channels["acceleration_1"]
    rate = force.sampling_rate_hz
    pulses = extract_pulses(force.si, rate, expected=campaign.hits)
    starts = np.array([pulse.contact.first - BEFORE for pulse in pulses])
    others = np.delete(starts, hit)
    tf = estimate_transfer_function(
        acceleration.si, force.si, rate, starts=others, segment=SEGMENT, end_weight=END_WEIGHT
    )
    window = slice(starts[hit], starts[hit] + SEGMENT)
    return (
        (np.arange(SEGMENT) - BEFORE) / rate,
        force.si[window],
        deconvolve(acceleration.si[window], tf, rate),
    )


def draw(campaign: HammerCampaign) -> Figure:
    """The first hit of the first test with a tip of delrin."""
    time, measured, computed = forces(campaign, campaign.tests_with("delrin")[0])
    figure = new_figure(7.0, 4.0)
    axes = figure.subplots()
    shown = slice(BEFORE // 2, int(np.searchsorted(time, _SHOWN_S)))
    axes.plot(time[shown] * 1e3, measured[shown], color=MEASURED, lw=1.4, label="load cell")
    axes.plot(
        time[shown] * 1e3,
        computed[shown],
        "--",
        color=MODEL,
        lw=1.4,
        label="from the plate's acceleration",
    )
    axes.set_xlabel("time since first contact (ms)")
    axes.set_ylabel("force (N)")
    axes.set_title(campaign.note, fontsize=9)
    axes.legend(frameon=False)
    return figure
