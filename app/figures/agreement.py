"""A figure of one quantity against another that should be equal."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from .figure import ColourRole, LineSeries, Plot, PlotAxis, PlotSeries, PointSeries

#: Points of a figure: more hide each other, and a file must stay small enough to send.
MOST_POINTS = 2000


def agreement_plot(
    title: str, clouds: Sequence[PointSeries], x: PlotAxis, y: PlotAxis, off: float = 0.0
) -> Plot:
    """`clouds` on one scale for both axes, with the line where the quantities are equal.

    Dashed on either side of it: where they differ by the share `off`. Of more than `MOST_POINTS`
    points as many are drawn.
    """
    most = MOST_POINTS // max(len(clouds), 1)
    thinned = [_thinned(cloud, most, "log" in (x.scale, y.scale)) for cloud in clouds]
    ends = Plot(title, x, y, tuple(thinned), equal_scales=True).limits("x")
    lines: list[PlotSeries] = [
        LineSeries(
            x=np.array(ends), y=np.array(ends), role=ColourRole.REFERENCE, width=1.3, silent=True
        )
    ]
    for slope in (1 - off, 1 + off) if off else ():
        fine = np.geomspace(*ends, 50) if x.scale == "log" else np.array(ends)
        lines.append(
            LineSeries(
                x=fine,
                y=slope * fine,
                role=ColourRole.TOLERANCE,
                dash="dash",
                width=1.3,
                silent=True,
            )
        )
    x, y = (replace(axis, limits=ends) for axis in (x, y))
    return Plot(title, x, y, (*lines, *thinned))


def _thinned(cloud: PointSeries, most: int, logarithmic: bool) -> PointSeries:
    """Points that can be drawn, evenly thinned to `most`."""
    good = np.isfinite(cloud.x) & np.isfinite(cloud.y)
    if logarithmic:
        good &= (cloud.x > 0) & (cloud.y > 0)
    rows = np.flatnonzero(good)
    if rows.size > most:
        rows = rows[np.unique(np.linspace(0, rows.size - 1, most).astype(int))]
    labels = tuple(cloud.labels[i] for i in rows) if cloud.labels else ()
    return replace(cloud, x=cloud.x[rows], y=cloud.y[rows], labels=labels)
