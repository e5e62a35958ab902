"""Fig. 4.10: NRMSE of every force model at every test."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pyroshock.training.plots.held_out import heat_map
from pyroshock.training.registry.evaluate import Evaluation

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def draw(judged: Evaluation) -> Figure:
    """The models from the best to the worst; the colour is logarithmic."""
    figure = heat_map(judged.pulses, judged.errors)
    figure.suptitle("Virtual campaign: not the thesis's recordings", fontsize=9)
    return figure
