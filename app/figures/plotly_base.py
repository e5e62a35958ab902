"""Traces and layouts that all charts share. Colours are names of the page's own (style.css): "c0"
to "c7", "quiet"."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

Trace = dict[str, Any]
Figure = dict[str, Any]
COLOURS = tuple(f"c{i}" for i in range(8))
#: Beside the colours, for those who cannot tell all of them apart: five and eight have no common
#: divisor, so that 40 curves differ in colour or dashes.
DASHES = ("solid", "dash", "dot", "dashdot", "longdash")


def spelled(value: Any) -> Any:
    """Words as plotly.js shows them letter by letter: it takes `<b>` and `<a href>` in a name for
    its own markup."""
    if isinstance(value, str):
        return value.replace("&", "&amp;").replace("<", "&lt;")
    if isinstance(value, list) and value and isinstance(value[0], str):
        return [spelled(element) for element in value]
    return value


def _spelled(trace: Trace) -> Trace:
    return {
        **trace,
        **{
            key: spelled(trace[key])
            for key in ("name", "x", "y", "text", "customdata")
            if key in trace
        },
    }


def plain(values: ArrayLike, digits: int = 6) -> list[float | None]:
    """Numbers for JSON, to as many digits as a screen can show; null where there is none."""
    array = np.asarray(values, dtype=np.float64).ravel()
    finite = np.isfinite(array)
    size = np.abs(np.where(finite & (array != 0), array, 1.0))
    # all at once: a format for each number takes longer than the twin's plate
    places = digits - 1 - np.floor(np.log10(size))
    up, down = 10.0 ** np.clip(places, 0, 300), 10.0 ** np.clip(-places, 0, 300)
    with np.errstate(over="ignore", invalid="ignore"):
        short = np.round(array * up / down) / up * down
    return [
        value if there else None
        for value, there in zip(short.tolist(), finite.tolist(), strict=True)
    ]


def line(
    x: ArrayLike,
    y: ArrayLike,
    name: str,
    colour: str = "c0",
    *,
    dash: str = "solid",
    width: float = 2,
    **more: Any,
) -> Trace:
    """A curve."""
    style = {"color": colour, "dash": dash, "width": width}
    return {
        "type": "scatter",
        "mode": "lines",
        "x": plain(x, 9),
        "y": plain(y),
        "name": name,
        "line": style,
        **more,
    }


def points(x: ArrayLike, y: ArrayLike, name: str, colour: str = "c0", **more: Any) -> Trace:
    """Markers."""
    style = {"color": colour, "size": 7}
    return {
        "type": "scatter",
        "mode": "markers",
        "x": plain(x),
        "y": plain(y),
        "name": name,
        "marker": style,
        **more,
    }


def bars(x: Sequence[str], y: ArrayLike, name: str, colour: str = "c0", **more: Any) -> Trace:
    """A bar for each word."""
    return {
        "type": "bar",
        "x": list(x),
        "y": plain(y),
        "name": name,
        "marker": {"color": colour},
        **more,
    }


#: Colours of a `heat_map`: from low over none to high, and from none to all.
DIVERGING = ((0, "c0"), (0.5, "card"), (1, "c1"))
RISING = ((0, "card"), (1, "c0"))


def heat_map(
    labels: Sequence[str],
    values: Sequence[Sequence[float | None]],
    scale: tuple[float, float],
    title: str,
    colours: Sequence[tuple[float, str]] = RISING,
) -> Figure:
    """A square matrix by name, the first row at the top; `scale` ends the colours, whatever the
    values are."""
    trace: Trace = {
        "type": "heatmap",
        "x": spelled(list(labels)),
        "y": spelled(list(labels)),
        "z": [list(row) for row in values],
        "zmin": scale[0],
        "zmax": scale[1],
        "colorscale": [list(pair) for pair in colours],
        "colorbar": {
            "title": {"text": title, "side": "top"},
            "orientation": "h",
            "thickness": 10,
            "x": 0.5,
            "y": 1.02,
        }
        | {"yanchor": "bottom", "len": 1},
        "xgap": 1,
        "ygap": 1,
        "hovertemplate": "%{y}<br>%{x}<br>%{z:.2f}<extra></extra>",
    }
    small = {"type": "category", "tickfont": {"size": 9}, "showgrid": False}
    axes = {"xaxis": {**small, "tickangle": -90}, "yaxis": {**small, "autorange": "reversed"}}
    return {
        "data": [trace],
        "layout": {**axes, "plot_bgcolor": "rule", "margin": {"t": 76, "r": 8}},
    }


def band(
    x: ArrayLike, lower: ArrayLike, upper: ArrayLike, name: str, colour: str = "c0"
) -> list[Trace]:
    """The area between two curves, under one entry of the legend."""
    edge: dict[str, Any] = {
        "mode": "lines",
        "line": {"width": 0, "color": colour},
        "hoverinfo": "skip",
    }
    low = {"type": "scatter", "x": plain(x, 9), "y": plain(lower), "showlegend": False, **edge}
    fill = {"fill": "tonexty", "fillcolor": f"{colour}/0.22", "name": name}
    return [low, {"type": "scatter", "x": plain(x, 9), "y": plain(upper), **edge, **fill}]


def figure(
    traces: Sequence[Trace],
    x: str,
    y: str,
    *,
    log_x: bool = False,
    log_y: bool = False,
    **layout: Any,
) -> Figure:
    """A chart of one pair of axes; titles carry their unit."""
    axes: dict[str, dict[str, Any]] = {
        "xaxis": {"title": {"text": spelled(x)}, "type": "log" if log_x else "linear"},
        "yaxis": {"title": {"text": spelled(y)}, "type": "log" if log_y else "linear"},
    }
    for axis, log in (("xaxis", log_x), ("yaxis", log_y)):
        if log:
            axes[axis] |= {"exponentformat": "power", "dtick": 1}
    return {"data": [_spelled(trace) for trace in traces], "layout": {**axes, **layout}}


def categories(traces: Sequence[Trace], x: str, y: str, **layout: Any) -> Figure:
    """A chart over words."""
    axes = {
        "xaxis": {"title": {"text": spelled(x)}, "type": "category"},
        "yaxis": {"title": {"text": spelled(y)}},
    }
    return {"data": [_spelled(trace) for trace in traces], "layout": {**axes, **layout}}
