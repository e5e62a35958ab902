"""Predicted against measured peak force and contact time."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...dataset.table import Floats, PulseTable
from ..metrics.reconstruct import figures, reconstruct
from ..models.base import ContactPrediction
from .canvas import MARKERS, new_figure, tip_colours

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def predicted_against_measured(pulses: PulseTable, prediction: ContactPrediction) -> Figure:
    """Two panels, logarithmic: tips differ by decades, and what counts is relative. Dotted: 10 % off."""
    peak = figures(reconstruct(prediction.force_n), prediction.contact_time_s).peak_force_n
    figure = new_figure(9.5, 4.8)
    left, right = figure.subplots(1, 2)
    _panel(left, pulses, pulses.peak_force_n, peak, "peak force (N)")
    _panel(right, pulses, pulses.contact_time_s * 1e3, prediction.contact_time_s * 1e3, "contact time (ms)")
    left.legend(frameon=False, loc="upper left")
    return figure


def _panel(axes: Axes, pulses: PulseTable, measured: Floats, predicted: Floats, name: str) -> None:
    shown = predicted > 0
    for i, (tip, colour) in enumerate(tip_colours(pulses.tip_material).items()):
        rows = shown & (pulses.tip_material == tip)
        axes.plot(measured[rows], predicted[rows], MARKERS[i % len(MARKERS)], color=colour, ms=3, alpha=0.6, label=tip)
    ends = np.array([0.85 * measured.min(), 1.15 * measured.max()])
    axes.plot(ends, ends, color="black", lw=0.8)
    for off in (0.9, 1.1):
        axes.plot(ends, off * ends, ":", color="black", lw=0.7)
    _decades(axes)
    axes.set_xlabel(f"measured {name}")
    axes.set_ylabel(f"predicted {name}")
    if not shown.all():
        axes.set_title(f"{np.count_nonzero(~shown)} predictions are not positive", fontsize=9)


def _decades(axes: Axes) -> None:
    """Both axes logarithmic and alike, marked at 1, 2 and 5 in plain figures."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

    axes.set_xscale("log")
    axes.set_yscale("log")
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.set_minor_locator(NullLocator())
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.set_aspect("equal")
