"""Plots within a page: their marks stand where their numbers do, in the colours of the page, and
points say what they are."""

from __future__ import annotations

import re

import numpy as np
import pytest
from pyroshock.app.figures.agreement import MOST_POINTS, agreement_plot
from pyroshock.app.figures.figure import (
    BandSeries,
    BarSeries,
    ColourRole,
    LineSeries,
    Plot,
    PlotAxis,
    PointSeries,
    ReferenceLine,
    Scale,
    TextLabel,
    category,
)
from pyroshock.app.figures.inline_svg import inline_svg
from pyroshock.app.figures.palette import colour_of
from support.checks.well_formed import Page

X = np.linspace(0.0, 1.0, 11)
TIME, FORCE = PlotAxis("time", "ms"), PlotAxis("force", "kN")


def cloud(x: np.ndarray, y: np.ndarray, name: str = "steel") -> PointSeries:
    return PointSeries(name=name, x=x, y=y, labels=tuple(f"run {i}" for i in range(x.size)))


def named_places(svg: str) -> dict[str, tuple[float, float]]:
    """Where each named point stands, by its name and value."""
    marks = re.findall(r'<use x="([\d.]+)" y="([\d.]+)"[^>]*><title>([^<]*)</title>', svg)
    return {name: (float(x), float(y)) for x, y, name in marks}


def line_ends(svg: str, role: ColourRole) -> list[tuple[float, float]]:
    """First and last point of the slanting curve of that colour."""
    style = rf'd="M ([^"]*?)"[^>]*style="fill: none; stroke: var\(--{role}\)'
    curves = [
        [(float(x), float(y)) for x, y in (pair.split() for pair in path.split(" L "))]
        for path in re.findall(style, svg)
    ]
    (ends,) = (
        [points[0], points[-1]]
        for points in curves
        if points[0][0] != points[-1][0] and points[0][1] != points[-1][1]
    )
    return ends


def test_a_chart_is_well_formed_and_says_what_it_shows() -> None:
    plot = Plot("pulse", TIME, FORCE, (LineSeries(name="steel <b>", x=X, y=X),))
    page = Page(inline_svg(plot))
    (root,) = page.of("svg")
    assert root["role"] == "img" and root["aria-label"] == plot.description
    assert {"time (ms)", "force (kN)", "0.50"} <= {word.strip() for word in page.words}
    assert inline_svg(plot) == inline_svg(plot)
    assert "pulse" not in page.words and "steel <b>" not in page.words, "the page writes those"


def test_colours_and_fonts_are_those_of_the_page() -> None:
    series = (
        LineSeries(x=X, y=X, role=category(2)),
        BandSeries(x=X, low=X - 1, high=X + 1, role=ColourRole.NOISE),
    )
    lines = (ReferenceLine("y", 0.5),)
    svg = inline_svg(Plot("p", TIME, FORCE, series, lines))
    assert re.findall(r"#[0-9a-f]{6}\b", svg) == [] and "font-family" not in svg
    assert "stroke: var(--c2)" in svg and "fill: var(--noise)" in svg
    names = set(re.findall(r"var\(--([\w-]+)\)", svg))
    assert names <= {"card", *ColourRole}


def test_points_stand_at_their_numbers_and_say_their_names() -> None:
    y = np.array([1.0, np.nan, 3.0])
    places = named_places(
        inline_svg(Plot("p", TIME, FORCE, (cloud(np.array([1.0, 2.0, 3.0]), y),)))
    )
    assert list(places) == ["run 0: 1", "run 2: 3"], "a gap is no point"
    (x0, y0), (x1, y1) = places.values()
    assert x0 < x1 and y0 > y1, "SVG counts downwards"


@pytest.mark.parametrize("scale", ["linear", "log"])
def test_equal_quantities_lie_on_the_diagonal_and_others_on_the_dashes(scale: Scale) -> None:
    x = np.array([1.0, 2.0, 5.0, 9.0])
    axes = PlotAxis("measured", "kN", scale), PlotAxis("predicted", "kN", scale)
    equal = inline_svg(agreement_plot("v", [cloud(x, x)], *axes))
    (ax, ay), (bx, by) = line_ends(equal, ColourRole.QUIET)
    for x_at, y_at in named_places(equal).values():
        assert y_at == pytest.approx(ay + (by - ay) * (x_at - ax) / (bx - ax), abs=0.1)
    plot = agreement_plot("v", [cloud(x, 1.1 * x)], *axes, off=0.1)
    *_, upper, points = plot.series
    assert isinstance(upper, LineSeries) and isinstance(points, PointSeries)
    assert np.interp(points.x, upper.x, upper.y) == pytest.approx(points.y, rel=2e-3)
    assert plot.x.limits == plot.y.limits


@pytest.mark.parametrize(
    ("low", "high"), [(16.0, 47.0), (0.52, 1.1), (1.3, 1.9), (0.9, 95.0), (1e2, 1e4), (3e-4, 40.0)]
)
def test_a_logarithmic_axis_has_three_numbers_however_little_it_shows(
    low: float, high: float
) -> None:
    axes = PlotAxis("measured", "kN", "log"), PlotAxis("predicted", "kN")
    svg = inline_svg(Plot("v", *axes, (LineSeries(x=np.array([low, high]), y=np.array([0.0, 1])),)))
    (ax, _), (bx, _) = line_ends(svg, ColourRole.CATEGORY_0)
    along_x = re.findall(
        r'<text[^>]*text-anchor: middle[^>]*x="([\d.]+)"[^>]*>([\d.]+)</text>', svg
    )
    assert 3 <= len(along_x) <= 8
    for place, number in along_x:
        value = low * (high / low) ** ((float(place) - ax) / (bx - ax))
        assert value == pytest.approx(float(number), rel=0.02)


def test_only_points_that_can_be_drawn_count_and_many_are_thinned() -> None:
    axes = PlotAxis("a", "1", "log"), PlotAxis("b", "1", "log")
    x, y = np.array([1.0, 2.0, -3.0, np.nan, 5.0]), np.array([1.0, 0.0, 1.0, 1.0, 4.0])
    svg = inline_svg(agreement_plot("v", [cloud(x, y)], *axes))
    assert list(named_places(svg)) == ["run 0: 1", "run 4: 4"]
    many = np.linspace(0, 1, 50_000)
    plot = agreement_plot("v", [cloud(many, many), cloud(many, many)], TIME, FORCE)
    clouds = [series for series in plot.series if isinstance(series, PointSeries)]
    assert sum(points.x.size for points in clouds) == MOST_POINTS
    assert named_places(inline_svg(agreement_plot("p", [], TIME, FORCE))) == {}


def test_a_long_title_of_an_axis_fits_it() -> None:
    def size(title: str) -> float:
        svg = inline_svg(Plot("p", TIME, PlotAxis(title, "1"), (LineSeries(x=X, y=X),)))
        (found,) = re.findall(rf'<text style="font-size: ([\d.]+)px[^>]*>{title}<', svg)
        return float(found)

    long = "a title of an axis that is much longer than the axis itself is high"
    assert size("force") == 10.0 > size(long) > 3.0


def test_bars_lie_between_their_ends_with_words_of_their_own() -> None:
    bars = BarSeries(
        position=np.array([0.0]), base=np.array([2.0]), end=np.array([6.0]), horizontal=True
    )
    axes = PlotAxis("share", "%", limits=(0.0, 8.0)), PlotAxis("", categories=("a",), hidden=True)
    svg = inline_svg(Plot("p", *axes, (bars,), labels=(TextLabel("valve", 0.0, 0.4),)))
    (path,) = re.findall(r'd="M ([^"]*)"[^>]*style="fill: var\(--c0\)', svg)
    x = [float(pair.split()[0]) for pair in path.removesuffix(" z").split(" L ")]
    (frame,) = re.findall(r'd="M ([^"]*)" style="fill: var\(--card\)', svg)
    across = [float(pair.split()[0]) for pair in frame.removesuffix(" z").split(" L ")]
    shares = [(value - min(across)) / (max(across) - min(across)) for value in (min(x), max(x))]
    assert shares == pytest.approx([0.25, 0.75], abs=0.01) and "valve" in svg


def test_letters_that_matplotlib_has_not_are_left_to_the_page() -> None:
    svg = inline_svg(Plot("p", PlotAxis("冲击 ทดสอบ $x$", "1"), FORCE))
    assert "冲击 ทดสอบ $x$" in svg


def test_every_role_has_a_colour_that_stands_for_it() -> None:
    for role in ColourRole:
        svg = inline_svg(Plot("p", TIME, FORCE, (LineSeries(x=X, y=X, role=role),)))
        names = re.findall(r"stroke: var\(--([\w-]+)\)", svg)
        assert any(colour_of(ColourRole(name)) == colour_of(role) for name in names), role
