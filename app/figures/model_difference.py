"""Two models' differences: by metric, and where."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ...training.evaluation.comparison import Comparison, Difference
from ...training.plots.style import COLOURS, LABELS, QUIET, new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def difference_figure(comparison: Comparison, metric: str = "force_nrmse") -> Figure:
    """Left, all metrics over all pulses; right, `metric` by group. In per cent of b's mean error,
    90 % intervals.

    Filled points are beyond chance (p < 0.05, on the right corrected for the number of groups).
    """
    groups = [row for row in comparison.by_group if row.metric == metric]
    rows = max(len(comparison.overall), len(groups))
    figure = new_figure(12 if groups else 7, 1.6 + 0.3 * rows)
    panels = figure.subplots(1, 2 if groups else 1, squeeze=False)[0]
    names = [LABELS[row.metric].split(" (")[0] for row in comparison.overall]
    _panel(panels[0], comparison.overall, names)
    panels[0].set_title("all held-out pulses", fontsize=10, pad=18)
    if groups:
        _panel(
            panels[1],
            groups,
            [f"{row.group[0]}: {row.group[1]}".replace("_", " ") for row in groups if row.group],
        )
        panels[1].set_title(f"{LABELS[metric].split(' (')[0]}, by group", fontsize=10, pad=18)
    figure.supxlabel(
        f"error of {comparison.a} minus that of {comparison.b}, % of the latter", fontsize=10
    )
    return figure


def _panel(axes: Axes, rows: Sequence[Difference], names: Sequence[str]) -> None:
    for place, row in enumerate(rows):
        scale = 100 / row.mean_b if row.mean_b > 0 else np.nan
        colour = (
            QUIET if not row.beyond_chance else COLOURS[2] if row.difference < 0 else COLOURS[1]
        )
        axes.plot([row.low * scale, row.high * scale], [place, place], color=colour, lw=2)
        face = colour if row.beyond_chance else "white"
        axes.plot(row.difference * scale, place, "o", ms=6, color=colour, markerfacecolor=face)
    axes.axvline(0, color="black", lw=0.8)
    axes.set_yticks(range(len(rows)), list(names))
    axes.set_ylim(len(rows) - 0.4, -0.6)
    axes.grid(axis="x", lw=0.4, alpha=0.5)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    if rows:
        corner: dict[str, Any] = {"xycoords": "axes fraction", "fontsize": 8, "va": "bottom"}
        axes.annotate(f"← {rows[0].a} better", (0.0, 1.0), ha="left", **corner)
        axes.annotate(f"{rows[0].b} better →", (1.0, 1.0), ha="right", **corner)
