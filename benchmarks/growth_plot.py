"""Growth curves on logarithmic axes, measured points with their spread and the fitted exponent in the legend."""

from __future__ import annotations

import statistics
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

#: One panel for each of these, in this order; predictions have one of their own.
_PANELS = (
    ("impacts", "", "impacts in the store", "time, s"),
    ("impacts", "bytes", "impacts in the store", "room, MB"),
    ("configurations", "", "configurations", "time, s"),
    ("pulses", "training", "pulses learned from", "time, s"),
    ("pulses", "1,000 predictions", "pulses learned from", "time, s"),
)
_ACROSS, _LEAST_RANGE = 3, 30.0


def draw(points: Iterable[Mapping[str, Any]], path: Path) -> None:
    """`points` as growth.json holds them (`growth.Point`); `path` ends in .png or another that Matplotlib writes."""
    import matplotlib as mpl
    from matplotlib.figure import Figure
    from matplotlib.ticker import NullFormatter

    mpl.rcParams["svg.hashsalt"] = "pyroshock"
    panels = [(panel, found) for panel in _PANELS if (found := _curves(points := list(points), *panel[:2]))]
    across, down = min(_ACROSS, len(panels)), -(-len(panels) // _ACROSS)
    figure = Figure(figsize=(5.2 * across, 4.8 * down), layout="constrained")
    places = figure.subplots(down, across, squeeze=False).ravel()
    for unused in places[len(panels) :]:
        unused.set_visible(False)
    for axes, ((_, _, x, y), found) in zip(places, panels, strict=False):
        for name, rows in found.items():
            _draw(axes, name, rows)
        axes.set(xscale="log", yscale="log", xlabel=x, ylabel=y)
        low, high = axes.get_ylim()
        wider = max(_LEAST_RANGE / (high / low), 1.0) ** 0.5  # what does not grow looks as if it did not
        axes.set_ylim(low / wider, high * wider)
        for each in (axes.xaxis, axes.yaxis):
            each.set_minor_formatter(NullFormatter())
        axes.grid(alpha=0.3)
        axes.legend(fontsize=7, loc="upper center", bbox_to_anchor=(0.5, -0.16), frameon=False)
    figure.savefig(path, dpi=110)


def _curves(points: Iterable[Mapping[str, Any]], axis: str, kind: str) -> dict[str, list[Mapping[str, Any]]]:
    """Of a panel: those on its axis, in bytes where it shows bytes, and whose name begins so."""
    found: dict[str, list[Mapping[str, Any]]] = {}
    for point in sorted(points, key=lambda point: point["size"]):
        shown = (
            point["unit"] == "bytes" if kind == "bytes" else point["curve"].startswith(kind) and point["unit"] == "s"
        )
        if point["axis"] == axis and shown:
            found.setdefault(point["curve"], []).append(point)
    return found


def _draw(axes: Any, name: str, rows: list[Mapping[str, Any]]) -> None:
    import numpy as np

    scale = 1e-6 if rows[0]["unit"] == "bytes" else 1.0
    sizes = [row["size"] for row in rows]
    middle = np.array([scale * statistics.median(row["values"]) for row in rows])
    ends = scale * np.array([[min(row["values"]), max(row["values"])] for row in rows]).T
    legend = name
    if len(rows) > 1:
        slope, level = np.polyfit(np.log(sizes), np.log(middle), 1)
        legend = f"{name}: $n^{{{slope:.2f}}}$"
    (line,) = axes.plot(sizes, middle, "o", markersize=4, label=legend)
    axes.errorbar(sizes, middle, np.abs(ends - middle), fmt="none", color=line.get_color(), capsize=2)
    if len(rows) > 1:
        axes.plot(sizes, np.exp(level) * np.power(sizes, slope), color=line.get_color(), linewidth=1)
