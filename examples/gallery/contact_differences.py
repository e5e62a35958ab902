"""Fig. 4.6: by how much the contact of the logical array is shorter than that of the walk, eq.
4.5."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from pyroshock.app.figures.figure import category
from pyroshock.app.figures.matplotlib_renderer import new_figure
from pyroshock.app.figures.palette import colour_of

from .picture import QUIET
from .resampling_error import by_hit
from .virtual_campaign import HammerCampaign

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: The thesis's largest, at its tests 1, 40 and 109.
PRINTED_PERCENT = 12.0


def difference_percent(campaign: HammerCampaign) -> NDArray[np.float64]:
    """The mean over the hits of each test (tests,)."""
    return np.asarray(100 * np.nanmean(by_hit(campaign, "segmentation_difference"), axis=0))


def draw(campaign: HammerCampaign) -> Figure:
    """A point a test, in the colour of its tip."""
    percent = difference_percent(campaign)
    tips = np.array([row["tip_material"] for row in campaign.rows])
    figure = new_figure(9.0, 3.8)
    axes = figure.subplots()
    for i, tip in enumerate(dict.fromkeys(tips.tolist())):
        colour = colour_of(category(i))
        axes.plot(
            campaign.tests[tips == tip], percent[tips == tip], "o", color=colour, ms=3, label=tip
        )
    axes.axhline(PRINTED_PERCENT, color=QUIET, lw=0.8, ls="--", label="the thesis's largest")
    axes.set_ylim(bottom=0)
    axes.set_xlabel("test")
    axes.set_ylabel("difference in contact time (%)")
    axes.set_title(campaign.note, fontsize=9)
    figure.legend(frameon=False, ncols=4, loc="outside lower center")
    return figure
