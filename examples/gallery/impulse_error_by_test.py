"""Fig. 5.5: the relative error of the predicted impulse at each test."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pyroshock.training.registry.evaluate import Evaluation

from . import cost_by_test

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def draw(judged: Evaluation) -> Figure:
    """As Fig. 5.4, of another metric."""
    return cost_by_test.draw(judged, "impulse_error")
