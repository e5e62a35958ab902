"""Diagnoses that are kept: each comes back as it was made, and a listing tells of them."""

from __future__ import annotations

import html
import json
import shutil
import sys
from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from pyroshock.app.operations.diagnose.diagnosing import (
    keep,
    last_report,
    report_json,
)
from pyroshock.app.operations.diagnose.report import page
from pyroshock.app.operations.diagnose.request import DiagnosisRequest, restriction_sentences
from pyroshock.app.operations.diagnose.stored import (
    kept_options,
    kept_report,
    kept_verdict,
    list_diagnoses,
    verdict_from_json,
    verdict_to_json,
)
from pyroshock.app.twins.adopted_effects import adopt
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
from pyroshock.schema.diagnoses import Diagnosis
from sqlalchemy import event
from support.records import verdicts
from support.stores.stores import opened, run_pyroshock

# --- A diagnosis that was kept is the one that was made: every number, every picture, every fit
# ---------------------
NAN, INF = float("nan"), float("inf")


def kept(verdict: Verdict) -> Verdict:
    """By way of text without numbers that JSON has not."""
    report, details = json.loads(json.dumps(verdict_to_json(verdict), allow_nan=False))
    return verdict_from_json(report, details)


def odd() -> Verdict:
    """Numbers that JSON has not wherever a diagnosis may come to one."""
    whole = verdicts.verdict()
    cause = Cause(
        ("gun.valve_flow",), 0.5, (Fitted("x", NAN, "", (-INF, INF)),), (1.0,), (verdicts.VALVE,)
    )
    return replace(
        whole,
        gap=GapSize("rms", NAN, 0.0, 0.01, True),
        where=replace(whole.where, factors=(Region("tip <b>", INF, NAN),)),
        causes=(cause, *whole.causes[1:]),
        shrinkage=(
            Shrinkage(
                (), "configuration", 1.0, 0.5, None, None, {"dB": (NAN, 2.0), "3 dB": (0.1, 0.2)}
            ),
        ),
        effects=(
            EffectShare(
                "gun.valve_flow", 1.0, NAN, (-INF, INF), NAN, 2, cause.parameters, named=True
            ),
        ),
        unexplained=Unexplained(NAN, (NAN, INF)),
        path=(PathStep("gun.valve_flow", INF, NAN),),
    )


WHOLE = {
    "whole": verdicts.verdict(),
    "gun": verdicts.gun(),
    "explored": verdicts.explored(),
    "unknown": verdicts.unknown(),
    "none": verdicts.none(),
}
MADE = pytest.mark.parametrize("made", [*WHOLE.values(), odd()], ids=[*WHOLE, "odd"])


@MADE
def test_kept_verdict_is_the_one_that_was_made(made):
    again = kept(made)
    assert verdict_to_json(made)[0] == report_json(made) and repr(again.as_json()) == repr(
        made.as_json()
    )
    assert again.fits == dict(made.fits)
    assert repr((again.effects, again.unexplained, again.path)) == repr(
        (made.effects, made.unexplained, made.path)
    )
    assert repr((again.what_if, again.error_map)) == repr((made.what_if, made.error_map))
    assert [(c.split, c.fitted) for c in again.causes] == [(c.split, c.fitted) for c in made.causes]
    for read_picture, other in zip(
        again.pictures.residuals + again.pictures.curves, _drawn(made), strict=True
    ):
        for item in fields(other):
            np.testing.assert_array_equal(
                getattr(read_picture, item.name), getattr(other, item.name)
            )


def _drawn(made: Verdict) -> tuple[ResidualPicture | CurvePicture, ...]:
    return (*made.pictures.residuals, *made.pictures.curves)


@pytest.mark.parametrize("made", WHOLE.values(), ids=WHOLE)
def test_page_of_a_kept_diagnosis_is_the_same(made):
    assert page(kept(made)) == page(made)


@pytest.fixture(scope="module")
def written_charts():
    """In place of a chart, a page has all that the renderer would draw of it: drawing takes a tenth
    of a second a page."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("pyroshock.app.documents.page.inline_svg", _every_number)
        yield


def _every_number(plot):
    with np.printoptions(threshold=sys.maxsize, floatmode="unique"):
        return html.escape(repr(plot))


@given(st.data())
def test_page_is_the_same_whatever_is_drawn(written_charts, data):
    numbers = arrays(
        np.float64, data.draw(st.integers(1, 6)), elements=st.floats(-1e6, 1e6) | st.just(NAN)
    )
    before, floor, x, measured = (data.draw(numbers) for _ in range(4))
    after = data.draw(st.none() | numbers)
    residual = ResidualPicture(
        "ln_peak", "contact", data.draw(st.sampled_from(["1", "dB"])), 0.03, before, after, floor
    )
    curve = CurvePicture(
        "pulse", "time", "s", "force", "N", x, measured, before, after, data.draw(st.booleans())
    )
    made = verdicts.verdict(pictures=Pictures(("a", "b"), (residual,), (curve,)))
    assert page(kept(made)) == page(made)


def test_infinities_come_back_and_details_are_of_a_known_format():
    values = np.array([NAN, INF, -INF, 1 / 3])
    made = verdicts.verdict(
        pictures=Pictures((), (ResidualPicture("a", "plate", "dB", 0.5, values, None, values),))
    )
    np.testing.assert_array_equal(kept(made).pictures.residuals[0].before, values)
    report, details = verdict_to_json(odd())
    before = json.dumps(report)
    verdict_from_json(report, details)
    assert json.dumps(report) == before
    with pytest.raises(
        ValueError, match=r"details of format 99; this software knows 1 and 2: diagnose again"
    ):
        verdict_from_json(report, {**details, "format": 99})
    # What was kept before shares and path were: no such keys in the report, none in its details.
    report, details = verdict_to_json(verdicts.verdict())
    for name in ("effects", "unexplained", "path"):
        del report[name]
    del details["effects"]
    again = verdict_from_json(report, {**details, "format": 1})
    assert (again.effects, again.unexplained, again.path) == ((), None, ())
    assert again.causes == verdicts.verdict().causes


# --- diagnoses that the store keeps: what a listing says, and that they come back whole
# -----------------------------
CAMPAIGN = "first-shots"


@pytest.fixture
def store(examples_db, tmp_path):
    with opened(f"sqlite:///{shutil.copy(examples_db, tmp_path)}") as store:
        yield store


def listed(store, **asked):
    with store.reading() as session:
        return list_diagnoses(session, **asked)


def test_kept_diagnosis_gives_its_page_or_says_what_is_missing(store):
    made = verdicts.verdict(campaign=CAMPAIGN)
    key = keep(store, made)
    with store.reading() as session:
        assert page(kept_verdict(session, key)) == page(made) and kept_report(
            session, key
        ) == report_json(made)
    key = keep(store, verdicts.verdict(campaign=CAMPAIGN))
    with store.reading() as session:
        assert kept_options(session, key) == {}
    with store.writing() as session:
        session.get_one(Diagnosis, key).details = None
    assert not listed(store)[0]["complete"]
    with (
        store.reading() as session,
        pytest.raises(LookupError, match=f"pyroshock diagnose {CAMPAIGN}"),
    ):
        kept_verdict(session, key)
    # So that what if can be asked of a diagnosis that was kept by another version.
    key = keep(store, verdicts.gun(campaign=CAMPAIGN), DiagnosisRequest(campaign=CAMPAIGN, seed=3))
    with store.writing() as session:
        row = session.get_one(Diagnosis, key)
        row.details = {**row.details, "options": {**row.details["options"], "calibrate": 20}}
    with store.reading() as session:
        assert (
            "calibrate" not in kept_options(session, key)
            and kept_options(session, key)["seed"] == 3
        )
    with store.reading() as session:
        with pytest.raises(LookupError, match="no diagnosis 7 in the store"):
            kept_verdict(session, 7)
        with pytest.raises(LookupError, match="no campaign 'winter'"):
            list_diagnoses(session, "winter")


def test_listing_goes_back_page_by_page(store):
    keys = [keep(store, verdicts.verdict(campaign=CAMPAIGN, seconds=float(i))) for i in range(5)]
    first = listed(store, limit=2)
    second = listed(store, limit=2, after=first[-1]["id"])
    assert [
        row["id"] for row in first + second + listed(store, limit=2, after=second[-1]["id"])
    ] == keys[::-1]


def test_row_tells_the_first_cause_and_reads_nothing_that_is_drawn(store):
    made = verdicts.verdict(campaign=CAMPAIGN)
    adopt(store, made, "gun.valve_flow", keep(store, made))
    (row,) = listed(store, campaign=CAMPAIGN)
    assert (row["campaign"], row["probability"]) == (CAMPAIGN, 0.93)
    assert row["first"] == "contact.layer_compliance or contact.plate_compliance"
    assert (row["gap"], row["noise_floor"], row["complete"]) == (0.041, 0.009, True)
    assert row["adopted"] == "version 1: gun.valve_flow"
    url = store.engine.url.render_as_string(False)
    (past,) = json.loads(
        run_pyroshock("diagnose", CAMPAIGN, "--list", "--db", url, "--json").stdout
    )
    assert past == row
    keep(store, verdicts.verdict(campaign=CAMPAIGN))
    statements_run = []
    event.listen(
        store.engine, "before_cursor_execute", lambda *given: statements_run.append(given[2])
    )
    assert listed(store)[0]["complete"]
    (query,) = [statement for statement in statements_run if "FROM diagnoses" in statement]
    assert query.count("details") == query.count("details IS NOT NULL") == 1


def test_what_if_is_marked_and_is_not_the_last_word_on_a_campaign(store):
    sentence, whole = restriction_sentences(("gun.valve_flow",)), verdicts.gun(campaign=CAMPAIGN)
    keep(store, whole, DiagnosisRequest(campaign=CAMPAIGN, seed=3))
    key = keep(
        store,
        verdicts.gun(campaign=CAMPAIGN, assumptions=sentence),
        DiagnosisRequest(campaign=CAMPAIGN, with_effects=["a"]),
    )
    assert [row["restricted"] for row in listed(store)] == [True, False]
    with store.reading() as session:
        assert last_report(session, CAMPAIGN) == report_json(whole)
        assert kept_options(session, key)["with_effects"] == ["a"]
