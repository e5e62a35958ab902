"""The picture of a diagnosis: the waterfall is true to the path, the bars to the shares, and paper can draw both."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyroshock.app.diagnose.report_charts import path_chart, path_rows, share_chart, share_rows
from pyroshock.app.documents.pdf import drawing_of
from pyroshock.diagnosis.verdict import EffectShare, GapSize, PathStep, Unexplained, Verdict
from support.checks.well_formed import Page
from support.records import verdicts

NAN = float("nan")


def test_waterfall_goes_from_the_error_before_to_what_remains() -> None:
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


def test_step_that_makes_it_worse_has_the_colour_of_error() -> None:
    path = (PathStep("gun.valve_flow", 0.5, -0.2),)
    step = path_rows(verdicts.gun(path=path))[1]
    assert (step.start, step.end, step.kind) == (50.0, 42.0, "bar-error")


def test_bars_are_shares_with_their_intervals_and_what_is_unexplained_beside() -> None:
    rows = share_rows(verdicts.gun())
    assert [(row.end, row.interval) for row in rows] == [
        (61.0, pytest.approx((52.0, 68.0))),
        (27.0, pytest.approx((20.0, 33.0))),
        (9.0, pytest.approx((5.0, 12.0))),
        (0.0, pytest.approx((0.0, 2.0))),
        (3.0, pytest.approx((1.0, 6.0))),
    ]
    assert [row.kind for row in rows] == ["bar-named", "bar-named", "bar-named", "bar-other", "bar-error"]
    assert rows[-1].name == "unexplained"


def test_verdict_without_shares_has_no_picture() -> None:
    assert path_chart(verdicts.verdict()) == share_chart(verdicts.verdict()) == ""
    gap = GapSize("rms", NAN, NAN, 0.01, True)
    assert path_chart(verdicts.gun(gap=gap)) == ""


@pytest.mark.parametrize("made", [verdicts.gun(), verdicts.unknown()], ids=["gun", "unknown"])
def test_charts_are_well_formed_and_drawn_on_paper(made: Verdict) -> None:
    for chart in (path_chart(made), share_chart(made)):
        assert Page(chart).of("svg")[0]["aria-label"]
        assert drawing_of(chart, "Helvetica", 300.0).width == 300.0


@given(
    st.lists(st.floats(-2, 2) | st.just(NAN), min_size=1, max_size=12),
    st.floats(1e-9, 1e6),
    st.floats(-1, 2) | st.just(NAN),
)
def test_bars_stay_in_the_frame(shares: list[float], before: float, after: float) -> None:
    effects = tuple(EffectShare(f"gun.{i}", 0.5, share, (share - 1, share + 1), 0.0) for i, share in enumerate(shares))
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


def test_effect_that_has_no_name_is_drawn_by_its_id() -> None:
    odd = replace(verdicts.gun().effects[0], effect="gun.<magic>")
    chart = share_chart(verdicts.gun(effects=(odd,)))
    assert "gun.&lt;magic&gt;" in chart and "gun.<magic>" not in chart
