"""The figures of a diagnosis are true to its numbers, and legends say what stands beside each
other once."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyroshock.app.documents.charts import legends_of
from pyroshock.app.documents.page import stylesheet
from pyroshock.app.figures.figure import (
    BarSeries,
    ColourRole,
    LineSeries,
    Plot,
    PlotAxis,
    PointSeries,
    ReferenceLine,
)
from pyroshock.app.figures.inline_svg import inline_svg
from pyroshock.app.figures.palette import colour_of
from pyroshock.app.operations.diagnose.report_charts import (
    path_plot,
    path_rows,
    share_plot,
    share_rows,
)
from pyroshock.diagnosis.verdict import EffectShare, GapSize, PathStep, Unexplained, Verdict
from support.checks.well_formed import Page
from support.records import verdicts

X = np.linspace(0.0, 1.0, 11)
AXES = PlotAxis("t", "ms"), PlotAxis("f", "kN")


def test_what_several_charts_share_stands_once_in_the_legend() -> None:
    ring = PointSeries(name="nominal", x=X, y=X, filled=False, role=ColourRole.BEFORE)
    twice = LineSeries(name="measured", x=X, y=X, dash="dash")
    first = Plot("a", *AXES, (ring, twice, twice), (ReferenceLine("y", 0.5, "tolerance"),))
    shared, others = legends_of([first, Plot("b", *AXES, (ring, LineSeries(x=X, y=X)))])
    assert [(entry.mark, entry.words) for entry in shared] == [("ring", "nominal")]
    assert [[(entry.mark, entry.words) for entry in own] for own in others] == [
        [("dash", "measured"), ("dash", "tolerance")],
        [],
    ]


def test_the_style_has_each_colour_in_light_and_in_dark_and_paper_is_light() -> None:
    light, _, dark = stylesheet("page.css").partition("@media screen and (prefers-color-scheme")
    for role in ColourRole:
        assert f"--{role}: {colour_of(role)};" in light
        assert f"--{role}: {colour_of(role, 'dark')};" in dark


# --- The picture of a diagnosis: the waterfall is true to the path, the bars to the shares
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
    assert (worse.start, worse.end, worse.role) == (50.0, 42.0, ColourRole.BEFORE)
    assert path_plot(verdicts.verdict()) is share_plot(verdicts.verdict()) is None
    assert path_plot(verdicts.gun(gap=GapSize("rms", NAN, NAN, 0.01, True))) is None
    rows = share_rows(verdicts.gun())
    assert [(row.end, row.interval) for row in rows] == [
        (61.0, pytest.approx((52.0, 68.0))),
        (27.0, pytest.approx((20.0, 33.0))),
        (9.0, pytest.approx((5.0, 12.0))),
        (0.0, pytest.approx((0.0, 2.0))),
        (3.0, pytest.approx((1.0, 6.0))),
    ]
    cause, other, error = ColourRole.CAUSE, ColourRole.OTHER, ColourRole.BEFORE
    assert [row.role for row in rows] == [cause, cause, cause, other, error]
    assert rows[-1].name == "unexplained"
    plot = share_plot(
        verdicts.gun(effects=(replace(verdicts.gun().effects[0], effect="gun.<magic>"),))
    )
    assert plot is not None
    chart = inline_svg(plot)
    assert "gun.&lt;magic&gt;" in chart and "gun.<magic>" not in chart


@pytest.mark.parametrize("made", [verdicts.gun(), verdicts.unknown()], ids=["gun", "unknown"])
def test_bars_are_drawn_with_their_names_and_values(made: Verdict) -> None:
    for plot, rows in ((path_plot(made), path_rows(made)), (share_plot(made), share_rows(made))):
        assert plot is not None
        words = {word.strip() for word in Page(inline_svg(plot)).words}
        assert {text for row in rows for text in (row.name, row.value) if text} <= words


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
    for plot in (path_plot(made), share_plot(made)):
        if plot is None:
            continue
        low, high = plot.limits("x")
        for bar in plot.series:
            if isinstance(bar, BarSeries) and bar.base is not None:
                assert low <= min(*bar.base, *bar.end) <= max(*bar.base, *bar.end) <= high
