"""Charts are true to their numbers, and every mark has its ink on paper."""

from __future__ import annotations

import re

import numpy as np
import pytest
from pyroshock.app.documents.line_styles import SERIES, STYLE, css, light, series_styles
from pyroshock.app.documents.pdf import drawing_of
from pyroshock.app.documents.svg import MOST_POINTS, Cloud, Curve, agreement_chart, dot_keys, line_chart, line_keys
from support.checks.well_formed import Page

X = np.linspace(0.0, 1.0, 11)


def points(svg: str, kind: str) -> list[tuple[float, float]]:
    """Of the first polyline of a class."""
    (found,) = [a["points"] for a in Page(svg).of("polyline") if a.get("class") == kind]
    assert found is not None
    return [(float(a), float(b)) for a, b in (pair.split(",") for pair in found.split())]


def cloud(x: np.ndarray, y: np.ndarray, name: str = "steel", colour: int = 0) -> Cloud:
    return Cloud(name, x, y, [f"run {i}" for i in range(x.size)], colour)


def test_equal_quantities_lie_on_the_diagonal() -> None:
    svg = agreement_chart("v", [cloud(X, X)], "model", "measured")
    (ax, ay), (bx, by) = points(svg, "zero")
    for dot in Page(svg).of("circle"):
        x, y = float(dot["cx"] or 0), float(dot["cy"] or 0)
        assert y == pytest.approx(ay + (by - ay) * (x - ax) / (bx - ax), abs=0.2)


@pytest.mark.parametrize("logarithmic", [False, True])
def test_dashed_lines_are_off_by_their_share(logarithmic: bool) -> None:
    x = np.array([1.0, 2.0, 5.0, 9.0])
    svg = agreement_chart("v", [cloud(x, 1.1 * x)], "a", "b", logarithmic=logarithmic, off=0.1)
    lines = [a["points"] or "" for a in Page(svg).of("polyline") if a.get("class") == "tolerance"]
    upper = [[float(n) for n in pair.split(",")] for pair in lines[1].split()]
    for dot in Page(svg).of("circle"):
        height = np.interp(float(dot["cx"] or 0), [p[0] for p in upper], [p[1] for p in upper])
        assert float(dot["cy"] or 0) == pytest.approx(height, abs=0.3)


def test_what_a_logarithm_has_not_is_left_out() -> None:
    x = np.array([1.0, 2.0, -3.0, np.nan, 5.0])
    svg = agreement_chart("v", [cloud(x, np.array([1.0, 0.0, 1.0, 1.0, 4.0]))], "a", "b", logarithmic=True)
    assert len(Page(svg).of("circle")) == 2


def test_many_points_are_thinned() -> None:
    x = np.linspace(0, 1, 50_000)
    assert len(Page(agreement_chart("v", [cloud(x, x), cloud(x, x)], "a", "b")).of("circle")) == MOST_POINTS


def test_spread_is_shaded_on_either_side() -> None:
    svg = line_chart("p", [Curve("steel", X, np.ones(11), 2, np.full(11, 0.5))], "t", "f")
    (shade,) = Page(svg).of("polygon")
    heights = {pair.split(",")[1] for pair in (shade["points"] or "").split()}
    assert shade["class"] == "spread-2" and len(heights) == 2


def test_legend_names_each_colour_once_and_in_order() -> None:
    curves = [Curve("b", X, X, 1), Curve("a", X, X, 0), Curve("b", X, X, 1)]
    assert line_keys(curves) == (("line-0", "a"), ("line-1", "b"))
    assert dot_keys([cloud(X, X)]) == ()
    assert dot_keys([cloud(X, X, "a", 0), cloud(X, X, "b", SERIES)]) == (("dot-0", "a"), ("dot-0", "b"))


def test_no_curves_make_an_empty_chart() -> None:
    assert Page(line_chart("p", [], "t", "f")).of("polyline") == []
    assert Page(agreement_chart("p", [], "t", "f")).of("circle") == []


def test_colours_on_paper_are_those_of_the_light_page() -> None:
    for name, colour in light().items():
        assert f"--{name}: {colour}" in STYLE + css()
    assert series_styles()["before"].stroke == light()["before"]


def test_every_series_is_drawn_on_screen_as_on_paper() -> None:
    for name in series_styles():
        assert re.search(rf"\.{name}\b", STYLE + css()) or name == "tick", name


def test_paper_shows_the_marks_where_the_screen_does() -> None:
    curves = [Curve("steel", X, X**2, 0, np.full(11, 0.1)), Curve("brass", X, X, 1)]
    svg = line_chart("p", curves, "t", "f", diagonal=True)
    drawing = drawing_of(svg, "Helvetica", 180.0)
    (group,) = drawing.contents
    scale, _, _, down, _, top = group.transform
    assert (drawing.width, drawing.height) == (180.0, pytest.approx(110.0))
    assert (scale, down, top) == (0.5, -0.5, pytest.approx(110.0))
    drawn = [shape.points for shape in group.contents if type(shape).__name__ == "PolyLine"]
    assert [number for pair in points(svg, "line-0") for number in pair] in [list(each) for each in drawn]
    words = [shape.contents[0].text for shape in group.contents if type(shape).__name__ == "Group"]
    assert {"t", "f", "0.5"} <= set(words)


@pytest.mark.parametrize("bad", ['<rect class="grid"/>', '<line class="strange" x1="0" x2="1" y1="0" y2="1"/>'])
def test_what_paper_does_not_know_is_refused(bad: str) -> None:
    with pytest.raises(ValueError, match=r"rect|strange"):
        drawing_of(f'<svg viewBox="0 0 360 220">{bad}</svg>', "Helvetica", 100.0)
