"""Fig. 4.4: what the smoothing spline leaves of each measured pulse, as NRMSE."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from pyroshock.app.figures.matplotlib_renderer import new_figure

from .virtual_campaign import HammerCampaign

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def by_hit(campaign: HammerCampaign, column: str) -> NDArray[np.float64]:
    """A stored figure of every pulse (hits x tests); NaN where a hit gave none."""
    found = campaign.pulses(column)
    grid = np.full((campaign.hits, len(campaign.tests)), np.nan)
    grid[found["repetition"] - 1, np.searchsorted(campaign.tests, found["run"])] = found[column]
    return grid


def draw(campaign: HammerCampaign) -> Figure:
    """Hits down, tests across: the tips' groups of six show."""
    percent = 100 * by_hit(campaign, "spline_nrmse")
    figure = new_figure(10.0, 2.9)
    axes = figure.subplots()
    extent = (campaign.tests[0] - 0.5, campaign.tests[-1] + 0.5, campaign.hits + 0.5, 0.5)
    picture = axes.imshow(
        percent, aspect="auto", cmap="viridis", extent=extent, interpolation="nearest", vmin=0
    )
    axes.set_yticks(range(1, campaign.hits + 1))
    axes.set_xlabel("test")
    axes.set_ylabel("hit")
    axes.set_title(campaign.note, fontsize=9)
    figure.colorbar(picture, ax=axes, label="NRMSE, eq. 4.4 (%)")
    return figure
