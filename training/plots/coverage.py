"""Whether intervals hold what they promise."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from ...array_types import Floats
from ...dataset.table import PulseTable
from ..models.base import ContactPrediction
from .style import COLOURS, MARKERS, new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LEVELS = np.concatenate([np.arange(0.1, 0.9, 0.1), [0.9, 0.95, 0.99]])

#: What the 90 % band should cover on held-out configurations.
WANTED = (0.87, 0.93)


def coverage_figure(pulses: PulseTable, predictions: Mapping[str, ContactPrediction]) -> Figure:
    """Promised against found coverage of central normal intervals, force points and contact time; one line a model.

    Models without spread are left out. `predictions` are of the held-out `pulses` row by row.
    """
    figure = new_figure(10, 4.8)
    for axes, name in zip(figure.subplots(1, 2), ("force", "contact time"), strict=True):
        _frame(axes, name)
        drawn = 0
        for model, prediction in predictions.items():
            score = standardised(pulses, prediction, name)
            if score is not None:
                style = {"color": COLOURS[drawn % len(COLOURS)], "marker": MARKERS[drawn % len(MARKERS)]}
                shares = coverage(score)
                axes.plot(LEVELS, shares, lw=1, ms=4, label=f"{model} ({shares[LEVELS == 0.9][0]:.3f})", **style)
                drawn += 1
        if drawn:
            axes.legend(frameon=False, loc="upper left", title="at 0.90")
    return figure


def coverage(scores: Floats, levels: Floats = LEVELS) -> Floats:
    """Share of standardised errors within the central normal interval of each of `levels`."""
    from scipy.special import ndtri

    shares: Floats = np.mean(np.abs(scores.ravel()) <= ndtri((1 + levels) / 2)[:, None], axis=1)
    return shares


def standardised(pulses: PulseTable, prediction: ContactPrediction, name: str) -> Floats | None:
    """Errors of "force" (n, 20) or "contact time" (n,) in spreads; None for a model without."""
    spread = prediction.force_spread_n if name == "force" else prediction.contact_time_spread_s
    if spread is None:
        return None
    force = name == "force"
    off = prediction.force_n - pulses.force_n if force else prediction.contact_time_s - pulses.contact_time_s
    # Where a law is certain (the ends of a hybrid's pulse) any error is beyond all of its intervals.
    return np.divide(off, spread, out=np.where(off == 0, 0.0, np.inf), where=spread > 0)


def _frame(axes: Axes, name: str) -> None:
    axes.plot([0, 1], [0, 1], color="black", lw=0.8)
    axes.plot([0.9, 0.9], WANTED, color="black", lw=5, alpha=0.3, solid_capstyle="butt")
    axes.set_title(name, fontsize=10)
    axes.set_xlabel("promised coverage")
    axes.set_ylabel("found coverage")
    axes.set_xlim(0, 1)
    axes.set_ylim(0, 1)
    axes.set_aspect("equal")
    axes.grid(lw=0.4, alpha=0.5)
