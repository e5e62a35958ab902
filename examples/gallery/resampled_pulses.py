"""Fig. 4.5: the recorded force and its smoothing spline, a pulse of each tip material."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from pyroshock.app.figures.matplotlib_renderer import new_figure

from .extraction_methods import extracted
from .picture import MEASURED, MODEL
from .virtual_campaign import HammerCampaign

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TIPS = ("aluminum", "delrin", "polyurethane")


def draw(campaign: HammerCampaign) -> Figure:
    """The first hit of the first test with each tip."""
    figure = new_figure(11.0, 3.6)
    for axes, tip in zip(figure.subplots(1, len(TIPS)), TIPS, strict=True):
        force, pulses = extracted(campaign, campaign.tests_with(tip)[0], "walk")
        pulse = pulses[0]
        samples = np.arange(pulse.contact.first, pulse.contact.last + 1)
        time_ms = (samples - pulse.contact.first) * force.period_s * 1e3
        fine_ms = np.arange(pulse.fine_force_n.size) * pulse.fine_period_s * 1e3
        label = f"{pulse.samples_in_contact} samples"
        axes.plot(
            time_ms,
            pulse.sign * force.si[samples] - pulse.rest_n,
            "o",
            color=MEASURED,
            ms=3.5,
            label=label,
        )
        axes.plot(fine_ms, pulse.fine_force_n, color=MODEL, lw=1.2, label="smoothing spline")
        axes.set_xlabel("time (ms)")
        axes.set_ylabel("force (N)")
        axes.set_title(f"{tip}: NRMSE {100 * pulse.spline_nrmse:.2f} %", fontsize=10)
        axes.legend(frameon=False, fontsize=8)
    figure.suptitle(campaign.note, fontsize=9)
    return figure
