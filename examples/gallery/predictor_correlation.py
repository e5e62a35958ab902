"""Fig. 4.8: how the 13 predictors of Table 4.3 hang together."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from pyroshock.app.figures.matplotlib_renderer import matplotlib_figure
from pyroshock.app.operations.train.dataset_figures import correlation_plot

from .virtual_campaign import HammerCampaign

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def draw(campaign: HammerCampaign) -> Figure:
    """Pearson's correlation over all pulses; the velocity is what the hammer's accelerometer
    gave."""
    return matplotlib_figure(replace(correlation_plot(campaign.table()), notes=(campaign.note,)))
