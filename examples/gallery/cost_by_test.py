"""Fig. 5.4: the cost of eq. 5.4 at each test, for the two trained models and the three pulses of
physics."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from pyroshock.app.figures.matplotlib_renderer import matplotlib_figure
from pyroshock.app.operations.train.registered_figures import by_test_figure
from pyroshock.training.evaluation.metrics import PulseErrors
from pyroshock.training.registry.evaluate import Evaluation

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: The thesis's coregional process, and its pulses.
COMPARED = ("coregional-gp", "hann", "hunter", "reed")
#: Its tuned network, or in its place one that learns in seconds.
NETWORKS = ("nn-ga", "nn-trilayer", "nn-medium")


def five(judged: Evaluation) -> dict[str, PulseErrors]:
    """Errors of the models of Table 5.2, as far as they were trained."""
    network = next((name for name in NETWORKS if name in judged.errors), None)
    return {name: judged.errors[name] for name in (*COMPARED, network) if name in judged.errors}


def draw(judged: Evaluation, metric: str = "cost") -> Figure:
    """A panel a model, the best on top; a point a test, in the colour of its tip."""
    figure = by_test_figure(judged.pulses, five(judged), metric)
    note = "Virtual campaign: not the thesis's recordings"
    return matplotlib_figure(replace(figure, notes=(note,)))
