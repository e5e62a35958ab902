"""Fig. 4.8: how the 13 predictors of Table 4.3 hang together."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pyroshock.app.common.plots import new_figure
from pyroshock.app.operations.train.datasets import draw_correlation

from .virtual_campaign import HammerCampaign

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def draw(campaign: HammerCampaign) -> Figure:
    """Pearson's correlation over all pulses; the velocity is what the hammer's accelerometer
    gave."""
    figure = new_figure(7.4, 6.6)
    draw_correlation(figure.subplots(), campaign.table())
    figure.suptitle(campaign.note, fontsize=9)
    return figure
