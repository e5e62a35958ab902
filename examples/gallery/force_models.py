"""Fig. 4.10: NRMSE of every force model at every test."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from pyroshock.app.figures.matplotlib_renderer import matplotlib_figure
from pyroshock.app.operations.train.registered_figures import errors_figure
from pyroshock.training.registry.evaluate import Evaluation

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def draw(judged: Evaluation) -> Figure:
    """The models from the best to the worst; the colour is logarithmic."""
    figure = errors_figure(judged.pulses, judged.errors)
    note = "Virtual campaign: not the thesis's recordings"
    return matplotlib_figure(replace(figure, notes=(note,)))
