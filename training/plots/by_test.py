"""An error by test for several models: Fig. 5.4 (cost) and Fig. 5.5 (impulse) of the thesis."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from ...array_types import Floats
from ...dataset.table import PulseTable
from ..metrics.errors import PulseErrors
from .style import LABELS, PulseRuns, new_figure, number_tests, runs_of, tip_colours, wide_range

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def by_test(pulses: PulseTable, errors: Mapping[str, PulseErrors], metric: str = "cost") -> Figure:
    """A panel a model, best first, on one scale; a point a test, the mean of its held-out pulses; a line at the mean.

    `errors` by name of model, of the held-out `pulses` row by row. 180 tests of five models in one panel, as the thesis
    draws them, hide each other; the tips' colours show what its zigzag lines were to show.
    """
    values = {name: getattr(model, metric) for name, model in errors.items()}
    names = sorted(values, key=lambda name: float(values[name].mean()))
    runs = runs_of(pulses)
    figure = new_figure(10, 1.3 + 1.35 * len(names))
    panels = figure.subplots(len(names), 1, sharex=True, sharey=True, squeeze=False)[:, 0]
    for axes, name in zip(panels, names, strict=True):
        _panel(axes, runs, runs.mean(values[name]), name, float(values[name].mean()))
    if wide_range(np.concatenate([runs.mean(model) for model in values.values()])):
        panels[0].set_yscale("log")
    else:
        panels[0].set_ylim(bottom=0)
    number_tests(panels[-1], runs)
    figure.supylabel(LABELS[metric], fontsize=10)
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=len(labels), frameon=False, markerscale=2)
    return figure


def _panel(axes: Axes, runs: PulseRuns, values: Floats, name: str, mean: float) -> None:
    places = np.arange(len(runs))
    for tip, colour in tip_colours(runs.tip).items():
        here = runs.tip == tip
        axes.plot(places[here], values[here], "o", color=colour, ms=2.6, label=tip)
    axes.axhline(mean, color="black", lw=0.8)
    axes.set_title(f"{name}: {mean:.3g}", fontsize=9, loc="left", pad=3)
    axes.grid(axis="y", lw=0.4, alpha=0.5)
