"""Errors of many models over all tests: Fig. 4.10 of the thesis."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from ...dataset.table import PulseTable
from ..metrics.errors import PulseErrors
from .style import LABELS, new_figure, runs_of, tip_strip

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def heat_map(pulses: PulseTable, errors: Mapping[str, PulseErrors], metric: str = "force_nrmse") -> Figure:
    """Models down, tests across in run order, best model first; the colour is logarithmic, as errors spread so wide.

    `errors` by name of model, of the held-out `pulses` row by row. Figures at the right are means over pulses.
    """
    from matplotlib.colors import LogNorm

    values = {name: getattr(model, metric) for name, model in errors.items()}
    names = sorted(values, key=lambda name: float(values[name].mean()))
    runs = runs_of(pulses)
    table = np.stack([runs.mean(values[name]) for name in names])
    shown = table[table > 0]
    low, high = np.quantile(shown, [0.01, 0.99]) if shown.size else (0.1, 1.0)
    figure = new_figure(11, 2.3 + 0.28 * len(names))
    upper, strip = figure.subplots(2, 1, sharex=True, height_ratios=[len(names), 0.7])
    image = upper.imshow(
        np.maximum(table, low),
        aspect="auto",
        cmap="viridis",
        norm=LogNorm(low, max(high, low * 1.01)),
        interpolation="nearest",
        extent=(-0.5, len(runs) - 0.5, len(names) - 0.5, -0.5),
    )
    upper.set_yticks(range(len(names)), names)
    upper.tick_params(axis="x", length=0, labelbottom=False)
    means = upper.secondary_yaxis("right")
    means.set_yticks(range(len(names)), [f"{values[name].mean():.3g}" for name in names])
    means.tick_params(length=0)
    figure.colorbar(image, ax=upper, label=LABELS[metric], pad=0.02, extend="both")
    tip_strip(figure, strip, runs)
    return figure
