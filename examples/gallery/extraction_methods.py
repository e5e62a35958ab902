"""Fig. 4.3: a recording cut into pulses, by a walk from each peak and by a logical array."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from pyroshock.app.figures.matplotlib_renderer import new_figure
from pyroshock.ingest.extraction.pulses import ExtractedPulse, extract_pulses
from pyroshock.ingest.extraction.settings import ExtractionSettings, Segmentation
from pyroshock.signals.channel import Channel

from .picture import MEASURED, MODEL, QUIET
from .virtual_campaign import HammerCampaign

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_AROUND = 8  # samples on either side of a contact


def extracted(
    campaign: HammerCampaign, test: int, segmentation: Segmentation
) -> tuple[Channel, list[ExtractedPulse]]:
    """The force of a test, and its pulses by one of the two methods."""
    force = campaign.channels(test)["force"]
    settings = ExtractionSettings(segmentation=segmentation)
    return force, list(
        extract_pulses(force.si, force.sampling_rate_hz, settings, expected=campaign.hits)
    )


def draw(campaign: HammerCampaign) -> Figure:
    """The first test: left the whole recording, right its first contact; above the walk, below the
    logical array."""
    figure = new_figure(10.0, 5.4)
    panels = figure.subplots(2, 2, width_ratios=(2, 1))
    methods: tuple[tuple[Segmentation, str], ...] = (
        ("walk", "(a) while cycles"),
        ("mask", "(b) logical array"),
    )
    for (record, contact), (segmentation, title) in zip(panels, methods, strict=True):
        force, pulses = extracted(campaign, campaign.tests[0], segmentation)
        _draw_record(record, force, pulses)
        _draw_contact(contact, force, pulses[0], logical=segmentation == "mask")
        record.set_title(title, loc="left", fontsize=10)
    figure.suptitle(campaign.note, fontsize=9)
    return figure


def _draw_record(axes: Any, force: Channel, pulses: list[ExtractedPulse]) -> None:
    near = np.concatenate([np.arange(p.contact.first - 40, p.contact.last + 400) for p in pulses])
    far = np.arange(0, force.si.size, 50)  # between the hits only noise is left out
    shown = np.unique(np.concatenate([near, far]))
    axes.plot(shown * force.period_s, force.si[shown], color=QUIET, lw=0.8)
    for pulse in pulses:
        axes.axvspan(
            pulse.contact.first * force.period_s,
            pulse.contact.last * force.period_s,
            color=MODEL,
            alpha=0.5,
        )
    peaks = [pulse.contact.peak for pulse in pulses]
    axes.plot(np.array(peaks) * force.period_s, force.si[peaks], "v", color=MEASURED, ms=5)
    axes.set_xlabel("time (s)")
    axes.set_ylabel("force (N)")


def _draw_contact(axes: Any, force: Channel, pulse: ExtractedPulse, *, logical: bool) -> None:
    first, last = pulse.contact.first, pulse.contact.last
    samples = np.arange(first - _AROUND, last + _AROUND + 1)
    time_ms = (samples - first) * force.period_s * 1e3
    axes.plot(time_ms, force.si[samples], "o-", color=MEASURED, ms=3, lw=0.8, label="force")
    axes.axvspan(
        0, (last - first) * force.period_s * 1e3, color=MODEL, alpha=0.2, lw=0, label="contact"
    )
    if logical:
        above = force.si[samples] - pulse.rest_n > pulse.threshold_n
        axes.step(
            time_ms,
            above * pulse.peak_force_n,
            where="post",
            color="black",
            lw=0.9,
            label="logical array",
        )
    axes.set_xlabel("time (ms)")
    axes.set_ylabel("force (N)")
    axes.legend(frameon=False, fontsize=8, loc="upper left", bbox_to_anchor=(1.0, 1.0))
