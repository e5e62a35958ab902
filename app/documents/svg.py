"""Small charts as inline SVG, of curves and of clouds of points: no script, no fonts, colours by
the page's style, readable on a telephone.

Glossary: a chart is 360 by 220 units; `AxesFrame` maps numbers into it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

import numpy as np

from ...array_types import Floats
from ..common.number_format import format_number
from .line_styles import series

WIDTH, HEIGHT = 360.0, 220.0
_LEFT, _RIGHT, _TOP, _BOTTOM = 66.0, 10.0, 12.0, 40.0
#: On a logarithmic axis.
_MOST_TICKS = 7
#: Points that a curve keeps: more than a screen shows.
_POINTS = 400


@dataclass(frozen=True)
class AxesFrame:
    """Axes over the ranges `x` and `y`, each linear or logarithmic."""

    x: tuple[float, float]
    y: tuple[float, float]
    log_x: bool = False
    log_y: bool = False

    def across(self, values: Floats) -> Floats:
        """Of x values, in units of the chart."""
        return np.asarray(_LEFT + _share(values, self.x, self.log_x) * (WIDTH - _LEFT - _RIGHT))

    def up(self, values: Floats) -> Floats:
        """Of y values."""
        return np.asarray(
            HEIGHT - _BOTTOM - _share(values, self.y, self.log_y) * (HEIGHT - _TOP - _BOTTOM)
        )


def _share(values: Floats, ends: tuple[float, float], logarithmic: bool) -> Floats:
    """Where values lie between the ends of an axis: 0 and 1 are the ends."""
    low, high = (_log(np.asarray(end)) if logarithmic else end for end in ends)
    coordinates = _log(values) if logarithmic else np.asarray(values, dtype=np.float64)
    return np.asarray((coordinates - low) / (high - low if high > low else 1.0))


def _log(values: Floats) -> Floats:
    return np.log10(np.maximum(values, np.finfo(float).tiny))


def frame_of(
    x: Sequence[Floats], y: Sequence[Floats], *, log_x: bool = False, log_y: bool = False
) -> AxesFrame:
    """A frame around all finite values (positive ones on a logarithmic axis)."""
    return AxesFrame(_ends(x, log_x, 0.0), _ends(y, log_y, 0.05), log_x, log_y)


def _ends(values: Sequence[Floats], logarithmic: bool, margin: float) -> tuple[float, float]:
    finite_values = (
        np.concatenate([np.ravel(series) for series in values]) if values else np.zeros(0)
    )
    finite_values = finite_values[
        np.isfinite(finite_values) & ((finite_values > 0) | (not logarithmic))
    ]
    if not finite_values.size:
        return (1.0, 10.0) if logarithmic else (0.0, 1.0)
    low, high = float(finite_values.min()), float(finite_values.max())
    if logarithmic:
        return low / 1.2, high * 1.2
    room = margin * (high - low) or (0.5 * abs(high) or 0.5) * (1.0 if high == low else 0.0)
    return low - room, high + room


def chart(
    label: str,
    frame: AxesFrame,
    marks: Sequence[str],
    x_title: str,
    y_title: str,
    *,
    whole: bool = False,
) -> str:
    """The chart with its axes; `marks` are drawn between grid and labels. `whole`: x counts
    things."""
    return (
        f'<svg viewBox="0 0 {WIDTH:g} {HEIGHT:g}" role="img" aria-label="{escape(label)}">'
        f"{_grid(frame, whole)}{''.join(marks)}{_titles(x_title, y_title)}</svg>"
    )


def _grid(frame: AxesFrame, whole: bool) -> str:
    parts = []
    for value in ticks(frame.y, frame.log_y):
        y = float(frame.up(np.array(value)))
        parts.append(
            f'<line class="grid" x1="{_LEFT:g}" x2="{WIDTH - _RIGHT:g}" y1="{y:.1f}" y2="{y:.1f}"/>'
        )
        parts.append(
            f'<text class="tick" x="{_LEFT - 5:g}" y="{y + 3.5:.1f}" '
            f'text-anchor="end">{tick_text(value)}</text>'
        )
    for value in ticks(frame.x, frame.log_x):
        if whole and value != round(value):
            continue
        x = float(frame.across(np.array(value)))
        parts.append(
            f'<text class="tick" x="{x:.1f}" y="{HEIGHT - _BOTTOM + 14:g}" text-anchor="middle">'
        )
        parts.append(f"{tick_text(value)}</text>")
    return "".join(parts)


def _titles(x_title: str, y_title: str) -> str:
    across, middle = (WIDTH + _LEFT) / 2, (_TOP + HEIGHT - _BOTTOM) / 2
    turned = f'transform="translate(11 {middle:g}) rotate(-90)"'
    return (
        f'<text class="axis" x="{across:g}" y="{HEIGHT - 8:g}" '
        f'text-anchor="middle">{escape(x_title)}</text>'
        f'<text class="axis" {turned} text-anchor="middle">{escape(y_title)}</text>'
    )


def ticks(ends: tuple[float, float], logarithmic: bool = False) -> list[float]:
    """Round numbers within `ends`, few enough for an axis."""
    low, high = ends
    if logarithmic:
        decades = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
        inside = [
            k * 10.0**decade
            for decade in decades
            for k in (1, 2, 5)
            if low <= k * 10.0**decade <= high
        ]
        powers = (
            inside
            if len(inside) < _MOST_TICKS
            else [10.0**k for k in decades if low <= 10.0**k <= high]
        )
        return powers[:: 1 + len(powers) // _MOST_TICKS] or [low, high]
    step = 10.0 ** math.floor(math.log10((high - low) / 3)) if high > low else 1.0
    step *= next(k for k in (1, 2, 5, 10) if (high - low) / (k * step) <= 6)
    return [
        step * k for k in range(math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9) + 1)
    ]


def tick_text(value: float) -> str:
    """A number of an axis."""
    return format_number(0.0 if abs(value) < 1e-12 else value)


def line(frame: AxesFrame, x: Floats, y: Floats, kind: str) -> str:
    """A curve of CSS class `kind`, thinned to what a screen shows."""
    keep = (
        np.unique(np.linspace(0, x.size - 1, min(x.size, _POINTS)).astype(int))
        if x.size
        else np.zeros(0, dtype=int)
    )
    good = np.isfinite(y[keep]) & np.isfinite(x[keep])
    points = _pairs(frame.across(x[keep][good]), frame.up(y[keep][good]))
    return f'<polyline class="{kind}" points="{points}"/>'


def band(frame: AxesFrame, x: Floats, low: Floats, high: Floats, kind: str) -> str:
    """The area between two curves."""
    good = np.isfinite(low) & np.isfinite(high)
    across, outward = frame.across(x[good]), frame.up(high[good])
    back = frame.up(low[good])[::-1]
    return (
        f'<polygon class="{kind}" points="{_pairs(across, outward)} {_pairs(across[::-1], back)}"/>'
    )


def dots(frame: AxesFrame, x: Floats, y: Floats, kind: str, names: Sequence[str]) -> str:
    """A dot for each finite value; `names` appear on pointing at one."""
    places = zip(frame.across(x), frame.up(y), y, names, strict=True)
    return "".join(
        f'<circle class="{kind}" cx="{a:.1f}" cy="{b:.1f}" '
        f'r="3.4"><title>{escape(name)}: {value:.3g}</title></circle>'
        for a, b, value, name in places
        if math.isfinite(value)
    )


def level(frame: AxesFrame, value: float, kind: str) -> str:
    """A line across at `value`."""
    y = float(frame.up(np.array(value)))
    return (
        f'<line class="{kind}" x1="{_LEFT:g}" x2="{WIDTH - _RIGHT:g}" y1="{y:.1f}" y2="{y:.1f}"/>'
    )


def _pairs(x: Floats, y: Floats) -> str:
    return " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y, strict=True))


#: Points of a chart: more hide each other, and a file must stay small enough to send.
MOST_POINTS = 2000


@dataclass(frozen=True, eq=False)
class Curve:
    """One line, `x` and `y` (n,); `spread` (n,) shades as much on either side. `colour` is the
    number of a series."""

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


def line_chart(
    label: str,
    curves: Sequence[Curve],
    x_title: str,
    y_title: str,
    *,
    diagonal: bool = False,
    nominal: float | None = None,
    log_x: bool = False,
) -> str:
    """Curves over each other; with the line of equal values, or a dashed one at `nominal`, where
    they should be."""
    edges = [
        curve.y + sign * curve.spread
        for curve in curves
        if curve.spread is not None
        for sign in (-1, 1)
    ]
    edges += [] if nominal is None else [np.array([nominal])]
    frame = frame_of(
        [curve.x for curve in curves], [*(curve.y for curve in curves), *edges], log_x=log_x
    )
    marks = [_diagonal(frame)] if diagonal else []
    marks += [] if nominal is None else [level(frame, nominal, "tolerance")]
    for curve in curves:
        if curve.spread is not None:
            low, high = curve.y - curve.spread, curve.y + curve.spread
            marks.append(band(frame, curve.x, low, high, f"spread-{series(curve.colour)}"))
    marks += [line(frame, curve.x, curve.y, f"line-{series(curve.colour)}") for curve in curves]
    return chart(label, frame, marks, x_title, y_title)


def agreement_chart(
    label: str,
    clouds: Sequence[Cloud],
    x_title: str,
    y_title: str,
    *,
    logarithmic: bool = False,
    off: float = 0.0,
) -> str:
    """One quantity against another that should be equal, on one scale for both, with the line where
    they are.

    Dashed on either side of it: where they are off by the share `off`.
    """
    coordinates = (
        np.concatenate([np.concatenate([cloud.x, cloud.y]) for cloud in clouds])
        if clouds
        else np.zeros(0)
    )
    ends = frame_of([], [coordinates], log_y=logarithmic).y
    frame = AxesFrame(ends, ends, logarithmic, logarithmic)
    marks = [
        _diagonal(frame),
        *(_diagonal(frame, 1 + sign * off, "tolerance") for sign in (-1, 1) if off),
    ]
    for cloud in clouds:
        keep = _thinned_points(cloud.x, cloud.y, frame, MOST_POINTS // len(clouds))
        names = [cloud.names[i] for i in keep]
        marks.append(
            dots(frame, cloud.x[keep], cloud.y[keep], f"dot-{series(cloud.colour)}", names)
        )
    return chart(label, frame, marks, x_title, y_title)


def line_keys(curves: Sequence[Curve]) -> tuple[tuple[str, str], ...]:
    """The legend of curves, each name once, in the order of their colours."""
    classes = {
        curve.name: f"line-{series(curve.colour)}"
        for curve in sorted(curves, key=lambda curve: curve.colour)
    }
    return tuple((kind, name) for name, kind in classes.items())


def dot_keys(clouds: Sequence[Cloud]) -> tuple[tuple[str, str], ...]:
    """The legend of clouds; none for a single one."""
    return (
        tuple((f"dot-{series(cloud.colour)}", cloud.name) for cloud in clouds)
        if len(clouds) > 1
        else ()
    )


def _thinned_points(x: Floats, y: Floats, frame: AxesFrame, most: int) -> list[int]:
    """Points that can be drawn, evenly thinned to `most`."""
    good = np.isfinite(x) & np.isfinite(y)
    if frame.log_x:
        good &= x > 0
    if frame.log_y:
        good &= y > 0
    rows = np.flatnonzero(good)
    if rows.size > most:
        rows = rows[np.unique(np.linspace(0, rows.size - 1, most).astype(int))]
    return [int(row) for row in rows]


def _diagonal(frame: AxesFrame, slope: float = 1.0, kind: str = "zero") -> str:
    """y = slope x, as far as the frame reaches."""
    ends = np.array([max(frame.x[0], frame.y[0] / slope), min(frame.x[1], frame.y[1] / slope)])
    return line(frame, ends, slope * ends, kind)
