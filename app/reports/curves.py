"""Charts of curves and of clouds of points, in the inks of a report, on the axes of `svg`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...array_types import Floats
from .line_styles import series
from .svg import AxesFrame, band, chart, dots, frame_of, line

#: Points of a chart: more hide each other, and a file must stay small enough to send.
MOST_POINTS = 2000


@dataclass(frozen=True, eq=False)
class Curve:
    """One line, `x` and `y` (n,); `spread` (n,) shades as much on either side. `colour` is the number of a series."""

    name: str
    x: Floats
    y: Floats
    colour: int = 0
    spread: Floats | None = None


@dataclass(frozen=True, eq=False)
class Cloud:
    """Points `x`, `y` (n,), called by `names`."""

    name: str
    x: Floats
    y: Floats
    names: Sequence[str]
    colour: int = 0


def line_chart(label: str, curves: Sequence[Curve], x_title: str, y_title: str, *, diagonal: bool = False) -> str:
    """Curves over each other; with the line of equal values where that is what they should be."""
    edges = [curve.y + sign * curve.spread for curve in curves if curve.spread is not None for sign in (-1, 1)]
    frame = frame_of([curve.x for curve in curves], [*(curve.y for curve in curves), *edges])
    marks = [_diagonal(frame)] if diagonal else []
    for curve in curves:
        if curve.spread is not None:
            low, high = curve.y - curve.spread, curve.y + curve.spread
            marks.append(band(frame, curve.x, low, high, f"spread-{series(curve.colour)}"))
    marks += [line(frame, curve.x, curve.y, f"line-{series(curve.colour)}") for curve in curves]
    return chart(label, frame, marks, x_title, y_title)


def agreement_chart(
    label: str, clouds: Sequence[Cloud], x_title: str, y_title: str, *, logarithmic: bool = False, off: float = 0.0
) -> str:
    """One quantity against another that should be equal, on one scale for both, with the line where they are.

    Dashed on either side of it: where they are off by the share `off`.
    """
    coordinates = np.concatenate([np.concatenate([cloud.x, cloud.y]) for cloud in clouds]) if clouds else np.zeros(0)
    ends = frame_of([], [coordinates], logarithmic=logarithmic).y
    frame = AxesFrame(ends, ends, logarithmic)
    marks = [_diagonal(frame), *(_diagonal(frame, 1 + sign * off, "tolerance") for sign in (-1, 1) if off)]
    for cloud in clouds:
        keep = _kept(cloud.x, cloud.y, frame, MOST_POINTS // len(clouds))
        names = [cloud.names[i] for i in keep]
        marks.append(dots(frame, cloud.x[keep], cloud.y[keep], f"dot-{series(cloud.colour)}", names))
    return chart(label, frame, marks, x_title, y_title)


def line_keys(curves: Sequence[Curve]) -> tuple[tuple[str, str], ...]:
    """The legend of curves, each name once, in the order of their colours."""
    classes = {curve.name: f"line-{series(curve.colour)}" for curve in sorted(curves, key=lambda curve: curve.colour)}
    return tuple((kind, name) for name, kind in classes.items())


def dot_keys(clouds: Sequence[Cloud]) -> tuple[tuple[str, str], ...]:
    """The legend of clouds; none for a single one."""
    return tuple((f"dot-{series(cloud.colour)}", cloud.name) for cloud in clouds) if len(clouds) > 1 else ()


def _kept(x: Floats, y: Floats, frame: AxesFrame, most: int) -> list[int]:
    """Points that can be drawn, evenly thinned to `most`."""
    good = np.isfinite(x) & np.isfinite(y)
    if frame.logarithmic:
        good &= (x > 0) & (y > 0)
    rows = np.flatnonzero(good)
    if rows.size > most:
        rows = rows[np.unique(np.linspace(0, rows.size - 1, most).astype(int))]
    return [int(row) for row in rows]


def _diagonal(frame: AxesFrame, slope: float = 1.0, kind: str = "zero") -> str:
    """y = slope x, as far as the frame reaches."""
    ends = np.array([max(frame.x[0], frame.y[0] / slope), min(frame.x[1], frame.y[1] / slope)])
    return line(frame, ends, slope * ends, kind)
