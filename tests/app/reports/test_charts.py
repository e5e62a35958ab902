"""Charts of reports are true to their numbers, and paper can draw every mark of them."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyroshock.app.documents.line_styles import SERIES, STYLE, css, light, series_styles
from pyroshock.app.documents.pdf import drawing_of
from pyroshock.app.documents.svg import (
    MOST_POINTS,
    Cloud,
    Curve,
    agreement_chart,
    dot_keys,
    line_chart,
    line_keys,
)
from pyroshock.app.operations.diagnose.report_charts import (
    path_chart,
    path_rows,
    share_chart,
    share_rows,
)
from pyroshock.diagnosis.verdict import EffectShare, GapSize, PathStep, Unexplained, Verdict
from support.checks.well_formed import Page
from support.records import verdicts

# --- charts are true to their numbers, and every mark has its ink on paper ---
X = np.linspace(0.0, 1.0, 11)


def points(svg: str, kind: str) -> list[tuple[float, float]]:
    """Of the first polyline of a class."""
    (found,) = [a["points"] for a in Page(svg).of("polyline") if a.get("class") == kind]
    assert found is not None
    return [(float(a), float(b)) for a, b in (pair.split(",") for pair in found.split())]


def cloud(x: np.ndarray, y: np.ndarray, name: str = "steel", colour: int = 0) -> Cloud:
    return Cloud(name, x, y, [f"run {i}" for i in range(x.size)], colour)


def test_equal_quantities_lie_on_the_diagonal_and_points_are_thinned() -> None:
    svg = agreement_chart("v", [cloud(X, X)], "model", "measured")
    (ax, ay), (bx, by) = points(svg, "zero")
    for dot in Page(svg).of("circle"):
        x, y = float(dot["cx"] or 0), float(dot["cy"] or 0)
        assert y == pytest.approx(ay + (by - ay) * (x - ax) / (bx - ax), abs=0.2)
    numbers = np.array([1.0, 2.0, -3.0, np.nan, 5.0])
    svg = agreement_chart(
        "v", [cloud(numbers, np.array([1.0, 0.0, 1.0, 1.0, 4.0]))], "a", "b", logarithmic=True
    )
    assert len(Page(svg).of("circle")) == 2
    many = np.linspace(0, 1, 50_000)
    svg = agreement_chart("v", [cloud(many, many), cloud(many, many)], "a", "b")
    assert len(Page(svg).of("circle")) == MOST_POINTS
    assert Page(line_chart("p", [], "t", "f")).of("polyline") == []
    assert Page(agreement_chart("p", [], "t", "f")).of("circle") == []


@pytest.mark.parametrize("logarithmic", [False, True])
def test_dashed_lines_are_off_by_their_share(logarithmic: bool) -> None:
    x = np.array([1.0, 2.0, 5.0, 9.0])
    svg = agreement_chart("v", [cloud(x, 1.1 * x)], "a", "b", logarithmic=logarithmic, off=0.1)
    lines = [a["points"] or "" for a in Page(svg).of("polyline") if a.get("class") == "tolerance"]
    upper = [[float(n) for n in pair.split(",")] for pair in lines[1].split()]
    for dot in Page(svg).of("circle"):
        height = np.interp(float(dot["cx"] or 0), [p[0] for p in upper], [p[1] for p in upper])
        assert float(dot["cy"] or 0) == pytest.approx(height, abs=0.3)


def test_spread_legend_and_colours_are_those_of_the_curves() -> None:
    svg = line_chart("p", [Curve("steel", X, np.ones(11), 2, np.full(11, 0.5))], "t", "f")
    (shade,) = Page(svg).of("polygon")
    heights = {pair.split(",")[1] for pair in (shade["points"] or "").split()}
    assert shade["class"] == "spread-2" and len(heights) == 2
    curves = [Curve("b", X, X, 1), Curve("a", X, X, 0), Curve("b", X, X, 1)]
    assert line_keys(curves) == (("line-0", "a"), ("line-1", "b")) and dot_keys([cloud(X, X)]) == ()
    assert dot_keys([cloud(X, X, "a", 0), cloud(X, X, "b", SERIES)]) == (
        ("dot-0", "a"),
        ("dot-0", "b"),
    )
    for name, colour in light().items():
        assert f"--{name}: {colour}" in STYLE + css()
    assert series_styles()["before"].stroke == light()["before"]
    for name in series_styles():
        assert re.search(rf"\.{name}\b", STYLE + css()) or name == "tick", name


def text_of(shape: Any) -> str:
    """The letters of a text, which may change its font within a word."""
    return shape.text if hasattr(shape, "text") else "".join(map(text_of, shape.contents))


def test_paper_shows_the_marks_where_the_screen_does() -> None:
    curves = [Curve("steel", X, X**2, 0, np.full(11, 0.1)), Curve("brass", X, X, 1)]
    svg = line_chart("p", curves, "t", "f", diagonal=True)
    drawing = drawing_of(svg, "Helvetica", 180.0)
    (group,) = drawing.contents
    scale, _, _, down, _, top = group.transform
    assert (drawing.width, drawing.height) == (180.0, pytest.approx(110.0))
    assert (scale, down, top) == (0.5, -0.5, pytest.approx(110.0))
    drawn = [shape.points for shape in group.contents if type(shape).__name__ == "PolyLine"]
    assert [number for pair in points(svg, "line-0") for number in pair] in [
        list(each) for each in drawn
    ]
    words = [text_of(shape) for shape in group.contents if type(shape).__name__ == "Group"]
    assert {"t", "f", "0.5"} <= set(words)


@pytest.mark.parametrize(
    "bad", ['<rect class="grid"/>', '<line class="strange" x1="0" x2="1" y1="0" y2="1"/>']
)
def test_what_paper_does_not_know_is_refused(bad: str) -> None:
    with pytest.raises(ValueError, match=r"rect|strange"):
        drawing_of(f'<svg viewBox="0 0 360 220">{bad}</svg>', "Helvetica", 100.0)


# --- The picture of a diagnosis: the waterfall is true to the path, the bars to the shares, and
# paper can draw both
NAN = float("nan")


def test_waterfall_goes_to_what_remains_and_bars_are_shares() -> None:
    rows = path_rows(verdicts.gun())
    assert [(row.name, round(row.start, 6), round(row.end, 6)) for row in rows] == [
        ("before: the nominal model", 0.0, 42.0),
        ("+ flow resistance of the valve", 16.4, 42.0),
        ("+ atmosphere ahead of the projectile", 5.0, 16.4),
        ("+ leak past the projectile", 1.26, 5.0),
        ("what remains", 0.0, 1.26),
        ("with a learned correction (no cause)", 0.0, 0.85),
        ("measurement noise", 0.0, 0.424),
    ]
    assert [row.value for row in rows[1:4]] == ["61 % gone", "88 % gone", "97 % gone"]
    worse = path_rows(verdicts.gun(path=(PathStep("gun.valve_flow", 0.5, -0.2),)))[1]
    assert (worse.start, worse.end, worse.kind) == (50.0, 42.0, "bar-error")
    assert path_chart(verdicts.verdict()) == share_chart(verdicts.verdict()) == ""
    assert path_chart(verdicts.gun(gap=GapSize("rms", NAN, NAN, 0.01, True))) == ""
    rows = share_rows(verdicts.gun())
    assert [(row.end, row.interval) for row in rows] == [
        (61.0, pytest.approx((52.0, 68.0))),
        (27.0, pytest.approx((20.0, 33.0))),
        (9.0, pytest.approx((5.0, 12.0))),
        (0.0, pytest.approx((0.0, 2.0))),
        (3.0, pytest.approx((1.0, 6.0))),
    ]
    assert [row.kind for row in rows] == [
        "bar-named",
        "bar-named",
        "bar-named",
        "bar-other",
        "bar-error",
    ]
    assert rows[-1].name == "unexplained"
    chart = share_chart(
        verdicts.gun(effects=(replace(verdicts.gun().effects[0], effect="gun.<magic>"),))
    )
    assert "gun.&lt;magic&gt;" in chart and "gun.<magic>" not in chart


@pytest.mark.parametrize("made", [verdicts.gun(), verdicts.unknown()], ids=["gun", "unknown"])
def test_charts_are_well_formed_and_drawn_on_paper(made: Verdict) -> None:
    for chart in (path_chart(made), share_chart(made)):
        assert (
            Page(chart).of("svg")[0]["aria-label"]
            and drawing_of(chart, "Helvetica", 300.0).width == 300.0
        )


@given(
    st.lists(st.floats(-2, 2) | st.just(NAN), min_size=1, max_size=12),
    st.floats(1e-9, 1e6),
    st.floats(-1, 2) | st.just(NAN),
)
def test_bars_stay_in_the_frame(shares: list[float], before: float, after: float) -> None:
    effects = tuple(
        EffectShare(f"gun.{i}", 0.5, share, (share - 1, share + 1), 0.0)
        for i, share in enumerate(shares)
    )
    made = verdicts.gun(
        gap=GapSize("rms", before, 0.5 * before, 0.01, True),
        effects=effects,
        unexplained=Unexplained(after, (after, after)),
        path=(PathStep("gun.0", abs(after) * before, after),),
    )
    for chart in (path_chart(made), share_chart(made)):
        for tag in Page(chart).of("polygon") if chart else ():
            x = [float(pair.split(",")[0]) for pair in (tag["points"] or "").split()]
            assert 0 <= min(x) <= max(x) <= 360


def test_a_long_title_of_an_axis_fits_it() -> None:
    from pyroshock.app.documents.pdf_fonts import fonts

    font, _ = fonts()
    heights = []
    for title in ("force", "a title of an axis that is much longer than the axis itself is high"):
        drawing = drawing_of(line_chart("p", [], "t", title), font, 160.0)
        (text,) = [shape for shape in drawing.contents[0].contents if text_of_group(shape) == title]
        low_x, _, high_x, _ = text.contents[0].getBounds()  # of a text that stands upright
        heights.append(high_x - low_x)
    assert heights[0] < heights[1] <= 192.0


def text_of_group(shape: Any) -> str:
    return text_of(shape) if hasattr(shape, "contents") else ""
