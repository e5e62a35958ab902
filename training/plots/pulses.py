"""Measured pulses and the predicted ones on top, with their 90 % band."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from ...dataset.table import PulseTable
from ..metrics.errors import BAND, pulse_errors
from ..metrics.reconstruct import reconstruct
from ..models.base import ContactPrediction
from .style import COLOURS, new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Of the pulses of a tip, by their NRMSE: the best, two in between and the worst, so that no picture flatters.
SHARES = (0.0, 0.5, 0.9, 1.0)
_NAMES = ("best", "median", "90th percentile", "worst")


def pulse_grid(pulses: PulseTable, prediction: ContactPrediction) -> Figure:
    """A row a tip material, a column a rank by NRMSE. `prediction` is of the held-out `pulses` row by row."""
    nrmse = pulse_errors(pulses, prediction).force_nrmse
    tips = np.unique(pulses.tip_material)
    figure = new_figure(12, 2.6 * len(tips) + 0.6)
    grid = figure.subplots(len(tips), len(SHARES), squeeze=False)
    for i, tip in enumerate(tips):
        rows = np.flatnonzero(pulses.tip_material == tip)
        for j, row in enumerate(_ranked(rows, nrmse)):
            _draw(grid[i, j], pulses, prediction, int(row))
            which = f"{tip}, run {pulses.run[row]}, repetition {pulses.repetition[row]}"
            grid[i, j].set_title(f"{which}\nNRMSE {nrmse[row]:.3f} ({_NAMES[j]})", fontsize=8)
        grid[i, 0].set_ylabel("force (N)")
    for axes in grid[-1]:
        axes.set_xlabel("time (ms)")
    handles, labels = grid[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=len(labels), frameon=False)
    return figure


def _ranked(rows: NDArray[np.intp], nrmse: Floats) -> NDArray[np.intp]:
    order = rows[np.argsort(nrmse[rows], kind="stable")]
    return order[np.round(np.array(SHARES) * (len(order) - 1)).astype(np.intp)]


def _draw(axes: Axes, pulses: PulseTable, prediction: ContactPrediction, row: int) -> None:
    """One pulse: dots measured, line predicted, shades the band of the force and of the end of contact."""
    points, duration = pulses.force_n[row], pulses.contact_time_s[row] * 1e3
    fine = reconstruct(prediction.force_n[row : row + 1], 200)[0]
    end = prediction.contact_time_s[row] * 1e3
    axes.plot(np.linspace(0, duration, points.size), points, "o", color="black", ms=2.5, label="measured", zorder=3)
    axes.plot(np.linspace(0, end, fine.size), fine, color=COLOURS[0], lw=1.3, label="predicted")
    if prediction.force_spread_n is not None:
        wide = BAND * prediction.force_spread_n[row]
        mean, at = prediction.force_n[row], np.linspace(0, end, points.size)
        axes.fill_between(at, mean - wide, mean + wide, color=COLOURS[0], alpha=0.2, lw=0, label="90 % band of force")
    if prediction.contact_time_spread_s is not None:
        late = BAND * float(prediction.contact_time_spread_s[row]) * 1e3
        axes.axvspan(end - late, end + late, color=COLOURS[1], alpha=0.2, lw=0, label="90 % band of contact time")
    axes.axhline(0, color="black", lw=0.4)
