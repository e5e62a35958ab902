"""A dataset's predictors as a picture: how they hang together (thesis, Fig. 4.8), and which values they took."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ...array_types import Floats
from ...dataset.predictors import correlation
from ...dataset.table import Predictor, PulseTable
from ..plots import MEASURED, new_figure, save

_BINS = 24


def plot_dataset(table: PulseTable, path: Path) -> None:
    """Correlation matrix beside the histogram of each predictor. `ValueError` for a suffix that cannot be drawn."""
    d = len(table.predictors)
    figure = new_figure(14, 0.5 * d + 1.5)
    grid = figure.add_gridspec(1, 2, width_ratios=(3, 2))
    upper_left, right = figure.add_subfigure(grid[0, 0]), figure.add_subfigure(grid[0, 1])
    draw_correlation(upper_left.subplots(), table)
    for axes, predictor, column in zip(np.ravel(right.subplots(d, 1)), table.predictors, table.x.T, strict=True):
        _draw_values(axes, predictor, column)
    save(figure, path)


def draw_correlation(axes: Any, table: PulseTable) -> None:
    """The matrix with its numbers; predictors that never varied have none."""
    coefficients = correlation(table)
    picture = axes.imshow(coefficients.matrix, cmap="RdBu_r", vmin=-1, vmax=1)
    for (i, j), value in np.ndenumerate(coefficients.matrix):
        colour = "white" if abs(value) > 0.7 else "black"
        axes.text(
            j,
            i,
            "-" if np.isnan(value) else f"{round(value, 2) + 0.0:.2f}",
            ha="center",
            va="center",
            color=colour,
            fontsize=7,
        )
    axes.set_xticks(range(len(coefficients.names)), coefficients.names, rotation=90, fontsize=8)
    axes.set_yticks(range(len(coefficients.names)), coefficients.names, fontsize=8)
    axes.set_title(f"correlation of the predictors, {len(table)} pulses", fontsize=10)
    axes.figure.colorbar(picture, ax=axes, shrink=0.8)


def _draw_values(axes: Any, predictor: Predictor, column: Floats) -> None:
    if predictor.levels:
        counts = [int((column == i).sum()) for i in range(len(predictor.levels))]
        axes.bar(range(len(counts)), counts, width=0.5, color=MEASURED)
        axes.set_xticks(range(len(counts)), predictor.levels)
    else:
        axes.hist(column, bins=_BINS, color=MEASURED)
    axes.tick_params(labelsize=6)
    axes.xaxis.get_offset_text().set_fontsize(6)
    unit = f"\n({predictor.unit})" if predictor.unit else ""
    axes.set_ylabel(f"{predictor.name}{unit}", rotation=0, ha="right", va="center", fontsize=7)
