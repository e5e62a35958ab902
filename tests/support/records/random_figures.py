"""Figures of every kind, for Hypothesis."""

from __future__ import annotations

from typing import Any

import numpy as np
from hypothesis import strategies as st
from pyroshock.app.figures.figure import (
    DASHES,
    BandSeries,
    BarSeries,
    BoxSeries,
    ColourRole,
    HeatMap,
    LineSeries,
    Plot,
    PlotAxis,
    PlotGrid,
    PlotSeries,
    PointSeries,
    ReferenceLine,
    ReferenceRegion,
    StepSeries,
    TextLabel,
)

#: What a bench measures and more; subnormal numbers and overflows are nobody's measurement.
_FINITE = st.floats(-1e9, 1e9, allow_subnormal=False).filter(lambda v: v == 0 or abs(v) > 1e-12)
_NUMBER = _FINITE | st.sampled_from([float("nan"), float("inf")])
_WORDS = st.text("aé$<&\"'_^{}\\日 ", max_size=8)
_ROLES, _SIZES = st.sampled_from(ColourRole), st.integers(0, 12)


def _numbers(size: int, number: st.SearchStrategy[float] = _NUMBER) -> st.SearchStrategy[Any]:
    return st.lists(number, min_size=size, max_size=size).map(np.array)


@st.composite
def _common(draw: st.DrawFn) -> dict[str, Any]:
    return {
        "name": draw(_WORDS),
        "detail": draw(_WORDS),
        "role": draw(_ROLES),
        "opacity": draw(st.floats(0.1, 1.0)),
        "hidden": draw(st.booleans()),
        "silent": draw(st.booleans()),
    }


@st.composite
def _labels(draw: st.DrawFn, size: int) -> tuple[str, ...]:
    return tuple(draw(st.just([]) | st.lists(_WORDS, min_size=size, max_size=size)))


@st.composite
def all_series(draw: st.DrawFn, number: st.SearchStrategy[float], first: float) -> PlotSeries:
    """A series of any kind but a heat map; positions of bars and boxes begin at `first`."""
    size, common = draw(_SIZES), draw(_common())
    x, y, z = (draw(_numbers(size, number)) for _ in range(3))
    kind = draw(st.sampled_from(["line", "points", "steps", "bars", "boxes", "band"]))
    places = first + np.arange(size, dtype=np.float64)
    if kind == "line":
        dash, marks = draw(st.sampled_from(DASHES)), draw(st.booleans())
        return LineSeries(x, y, dash, marks=marks, labels=draw(_labels(size)), **common)
    if kind == "points":
        ends = (
            {"y_low": np.minimum(y, z), "y_high": np.maximum(y, z)} if draw(st.booleans()) else {}
        )
        return PointSeries(x, y, **ends, filled=draw(st.booleans()), **common)
    if kind == "steps":
        edges = first + np.arange(size + 1, dtype=np.float64)
        return StepSeries(edges, y, filled=draw(st.booleans()), **common)
    if kind == "bars":
        base = y if draw(st.booleans()) else None
        return BarSeries(places, z, base, horizontal=draw(st.booleans()), **common)
    if kind == "boxes":
        return BoxSeries(
            places, tuple(draw(_numbers(draw(_SIZES), number)) for _ in places), **common
        )
    return BandSeries(x, np.minimum(y, z), np.maximum(y, z), **common)


@st.composite
def _axes(draw: st.DrawFn) -> PlotAxis:
    scale = draw(st.sampled_from(["linear", "log"]))
    flags = {name: draw(st.booleans()) for name in ("from_zero", "reversed", "whole", "hidden")}
    return PlotAxis(draw(_WORDS), draw(st.sampled_from(["kN", "1", "m/s²"])), scale, **flags)


@st.composite
def curve_plots(draw: st.DrawFn) -> Plot:
    """Series over numbers, linear or logarithmic."""
    x, y = draw(_axes()), draw(_axes())
    positive = st.floats(1e-6, 1e9)
    place = {axis: positive if scale == "log" else _FINITE
             for axis, scale in (("x", x.scale), ("y", y.scale))}  # fmt: skip
    lines = draw(st.lists(st.sampled_from(["x", "y"]), max_size=2))
    label = TextLabel(draw(_WORDS), draw(place["x"]), draw(place["y"]))
    return Plot(
        draw(_WORDS),
        x,
        y,
        tuple(draw(st.lists(all_series(_NUMBER, 1.0), max_size=4))),
        tuple(ReferenceLine(along, draw(place[along]), draw(_WORDS)) for along in lines),
        tuple(ReferenceRegion(along, 1.0, 2.0, draw(_WORDS)) for along in lines),
        (label,),
        equal_scales=draw(st.booleans()),
        cursor=draw(st.sampled_from(["nearest", "column"])),
    )


@st.composite
def category_plots(draw: st.DrawFn) -> Plot:
    """Bars, boxes and points over words."""
    names = tuple(draw(st.lists(_WORDS, min_size=1, max_size=40)))
    places, height = np.arange(len(names), dtype=np.float64), draw(_numbers(len(names)))
    kind = draw(st.sampled_from(["bars", "points", "boxes"]))
    series: PlotSeries
    if kind == "bars":
        series = BarSeries(places, height, horizontal=True)
    elif kind == "points":
        series = PointSeries(height, places, x_low=height - 1, x_high=height + 1)
    else:
        samples = tuple(draw(_numbers(draw(_SIZES))) for _ in names)
        words = PlotAxis(draw(_WORDS), categories=names)
        return Plot("boxes", words, draw(_axes()), (BoxSeries(places, samples),))
    axis = draw(_axes())
    return Plot("rows", axis, PlotAxis("", categories=names, reversed=True), (series,))


@st.composite
def heat_plots(draw: st.DrawFn) -> Plot:
    """A heat map over words."""
    rows, columns = draw(st.integers(1, 6)), draw(st.integers(1, 6))
    values = draw(_numbers(rows * columns)).reshape(rows, columns)
    colour = draw(_axes())
    palette = "rising" if colour.scale == "log" else draw(st.sampled_from(["rising", "diverging"]))
    x, y = (PlotAxis("level", categories=tuple("abcdef"[:count])) for count in (columns, rows))
    return Plot("map", x, y, (HeatMap(values, colour, palette),))


plots = curve_plots() | category_plots() | heat_plots()


@st.composite
def grids(draw: st.DrawFn) -> PlotGrid:
    """Two rows of two plots."""
    pairs = [tuple(draw(plots | st.none()) for _ in range(2)) for _ in range(2)]
    return PlotGrid(draw(_WORDS), tuple(pairs))


figures = plots | grids()
