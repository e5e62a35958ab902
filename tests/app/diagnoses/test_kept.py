"""A diagnosis that was kept is the one that was made: every number, every picture, every fit."""

from __future__ import annotations

import json
from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from pyroshock.app.diagnose.diagnosing import report_json
from pyroshock.app.diagnose.report import page
from pyroshock.app.diagnose.stored import verdict_from_json, verdict_to_json
from pyroshock.diagnosis.verdict import (
    Cause,
    CurvePicture,
    EffectShare,
    Fitted,
    GapSize,
    PathStep,
    Pictures,
    Region,
    ResidualPicture,
    Shrinkage,
    Unexplained,
    Verdict,
)
from support.records import verdicts

NAN, INF = float("nan"), float("inf")


def kept(verdict: Verdict) -> Verdict:
    """By way of text without numbers that JSON has not."""
    report, details = json.loads(json.dumps(verdict_to_json(verdict), allow_nan=False))
    return verdict_from_json(report, details)


def odd() -> Verdict:
    """Numbers that JSON has not wherever a diagnosis may come to one."""
    whole = verdicts.verdict()
    cause = Cause(("gun.valve_flow",), 0.5, (Fitted("x", NAN, "", (-INF, INF)),), (1.0,), (verdicts.VALVE,))
    return replace(
        whole,
        gap=GapSize("rms", NAN, 0.0, 0.01, True),
        where=replace(whole.where, factors=(Region("tip <b>", INF, NAN),)),
        causes=(cause, *whole.causes[1:]),
        shrinkage=(Shrinkage((), "configuration", 1.0, 0.5, None, None, {"dB": (NAN, 2.0), "3 dB": (0.1, 0.2)}),),
        effects=(EffectShare("gun.valve_flow", 1.0, NAN, (-INF, INF), NAN, 2, cause.parameters, named=True),),
        unexplained=Unexplained(NAN, (NAN, INF)),
        path=(PathStep("gun.valve_flow", INF, NAN),),
    )


MADE = pytest.mark.parametrize(
    "made",
    [verdicts.verdict(), verdicts.gun(), verdicts.unknown(), verdicts.none(), odd()],
    ids=["whole", "gun", "unknown", "none", "odd"],
)


@MADE
def test_kept_verdict_is_the_one_that_was_made(made):
    again = kept(made)
    assert repr(again.as_json()) == repr(made.as_json())
    assert again.fits == dict(made.fits)
    assert repr((again.effects, again.unexplained, again.path)) == repr((made.effects, made.unexplained, made.path))
    assert [(c.split, c.fitted) for c in again.causes] == [(c.split, c.fitted) for c in made.causes]
    for one, other in zip(again.pictures.residuals + again.pictures.curves, _drawn(made), strict=True):
        for item in fields(other):
            np.testing.assert_array_equal(getattr(one, item.name), getattr(other, item.name))


def _drawn(made: Verdict) -> tuple[ResidualPicture | CurvePicture, ...]:
    return (*made.pictures.residuals, *made.pictures.curves)


@pytest.mark.parametrize(
    "made",
    [verdicts.verdict(), verdicts.gun(), verdicts.unknown(), verdicts.none()],
    ids=["whole", "gun", "unknown", "none"],
)
def test_page_of_a_kept_diagnosis_is_the_same(made):
    assert page(kept(made)) == page(made)


@MADE
def test_report_is_what_scripts_read(made):
    assert verdict_to_json(made)[0] == report_json(made)


@given(st.data())
def test_page_is_the_same_whatever_is_drawn(data):
    count = data.draw(st.integers(1, 6))
    numbers = arrays(np.float64, count, elements=st.floats(-1e6, 1e6) | st.just(NAN))
    before, floor, x, measured = (data.draw(numbers) for _ in range(4))
    after = data.draw(st.none() | numbers)
    residual = ResidualPicture(
        "ln_peak", "contact", data.draw(st.sampled_from(["1", "dB"])), 0.03, before, after, floor
    )
    curve = CurvePicture("pulse", "time", "s", "force", "N", x, measured, before, after, data.draw(st.booleans()))
    made = verdicts.verdict(pictures=Pictures(("a", "b"), (residual,), (curve,)))
    assert page(kept(made)) == page(made)


def test_infinities_of_a_picture_come_back():
    """Levels of a channel that shows nothing are -inf dB."""
    values = np.array([NAN, INF, -INF, 1 / 3])
    made = verdicts.verdict(pictures=Pictures((), (ResidualPicture("a", "plate", "dB", 0.5, values, None, values),)))
    np.testing.assert_array_equal(kept(made).pictures.residuals[0].before, values)


def test_details_of_another_format_are_refused():
    report, details = verdict_to_json(verdicts.verdict())
    with pytest.raises(ValueError, match=r"details of format 99; this software knows 1 and 2: diagnose again"):
        verdict_from_json(report, {**details, "format": 99})


def test_making_a_verdict_leaves_the_report_as_it_is():
    report, details = verdict_to_json(odd())
    before = json.dumps(report)
    verdict_from_json(report, details)
    assert json.dumps(report) == before


def test_diagnosis_of_the_format_before_opens_without_shares():
    """What was kept before shares and path were: no such keys in the report, none in its details."""
    report, details = verdict_to_json(verdicts.verdict())
    for name in ("effects", "unexplained", "path"):
        del report[name]
    del details["effects"]
    again = verdict_from_json(report, {**details, "format": 1})
    assert (again.effects, again.unexplained, again.path) == ((), None, ())
    assert again.causes == verdicts.verdict().causes
