"""Diagnoses that the store keeps: what a listing says, and that they come back whole."""

from __future__ import annotations

import pytest
from pyroshock.app.demo.demo import ingest_examples
from pyroshock.app.diagnose.diagnosing import keep, last_report, past_diagnoses, report_json
from pyroshock.app.diagnose.report import page
from pyroshock.app.diagnose.request import DiagnosisRequest, restriction_sentences
from pyroshock.app.diagnose.stored import kept_options, kept_report, kept_verdict, list_diagnoses
from pyroshock.app.twins.adopted_effects import adopt
from pyroshock.schema.diagnoses import Diagnosis
from sqlalchemy import event
from support.records import verdicts
from support.stores.stores import opened

CAMPAIGN = "first-shots"


@pytest.fixture
def store(tmp_path):
    with opened(f"sqlite:///{tmp_path / 'lab.db'}", create=True) as store:
        ingest_examples(store)
        yield store


def listed(store, **asked):
    with store.reading() as session:
        return list_diagnoses(session, **asked)


def test_kept_diagnosis_gives_its_page_again(store):
    made = verdicts.verdict(campaign=CAMPAIGN)
    key = keep(store, made)
    with store.reading() as session:
        assert page(kept_verdict(session, key)) == page(made)
        assert kept_report(session, key) == report_json(made)


def test_listing_goes_back_page_by_page(store):
    keys = [keep(store, verdicts.verdict(campaign=CAMPAIGN, seconds=float(i))) for i in range(5)]
    first = listed(store, limit=2)
    second = listed(store, limit=2, after=first[-1]["id"])
    last = listed(store, limit=2, after=second[-1]["id"])
    assert [row["id"] for row in first + second + last] == keys[::-1]


def test_row_tells_the_first_cause_and_what_was_adopted(store):
    made = verdicts.verdict(campaign=CAMPAIGN)
    key = keep(store, made)
    adopt(store, made, "gun.valve_flow", key)
    (row,) = listed(store, campaign=CAMPAIGN)
    assert (row["campaign"], row["first"], row["probability"]) == (
        CAMPAIGN,
        "contact.layer_compliance or contact.plate_compliance",
        0.93,
    )
    assert (row["gap"], row["noise_floor"], row["complete"]) == (0.041, 0.009, True)
    assert row["adopted"] == "version 1: gun.valve_flow"
    with store.reading() as session:
        (past,) = past_diagnoses(session, CAMPAIGN)
    assert past == {name: value for name, value in row.items() if name not in ("campaign", "complete")}


def test_what_if_is_marked_and_is_not_the_last_word_on_a_campaign(store):
    sentence = restriction_sentences(("gun.valve_flow",))
    whole = verdicts.gun(campaign=CAMPAIGN)
    keep(store, whole, DiagnosisRequest(CAMPAIGN, seed=3))
    key = keep(
        store, verdicts.gun(campaign=CAMPAIGN, assumptions=sentence), DiagnosisRequest(CAMPAIGN, with_effects=["a"])
    )
    assert [row["restricted"] for row in listed(store)] == [True, False]
    with store.reading() as session:
        assert last_report(session, CAMPAIGN) == report_json(whole)
        assert kept_options(session, key)["with_effects"] == ["a"]


def test_options_of_a_diagnosis_that_was_kept_without_them_are_none(store):
    key = keep(store, verdicts.gun(campaign=CAMPAIGN))
    with store.reading() as session:
        assert kept_options(session, key) == {}


def test_an_option_that_there_was_once_is_left_out(store):
    """So that what if can be asked of a diagnosis that was kept by another version."""
    key = keep(store, verdicts.gun(campaign=CAMPAIGN), DiagnosisRequest(CAMPAIGN, seed=3))
    with store.writing() as session:
        row = session.get_one(Diagnosis, key)
        row.details = {**row.details, "options": {**row.details["options"], "calibrate": 20}}
    with store.reading() as session:
        assert "calibrate" not in kept_options(session, key)
        assert kept_options(session, key)["seed"] == 3


def test_diagnosis_without_details_is_listed_and_says_what_to_do(store):
    key = keep(store, verdicts.verdict(campaign=CAMPAIGN))
    with store.writing() as session:
        session.get_one(Diagnosis, key).details = None
    assert not listed(store)[0]["complete"]
    with store.reading() as session, pytest.raises(LookupError, match=f"pyroshock diagnose {CAMPAIGN}"):
        kept_verdict(session, key)


def test_listing_does_not_read_what_is_drawn(store):
    keep(store, verdicts.verdict(campaign=CAMPAIGN))
    said = []
    event.listen(store.engine, "before_cursor_execute", lambda *given: said.append(given[2]))
    assert listed(store)[0]["complete"]
    (query,) = [each for each in said if "FROM diagnoses" in each]
    assert query.count("details") == query.count("details IS NOT NULL") == 1


def test_unknown_ones_are_named(store):
    with store.reading() as session:
        with pytest.raises(LookupError, match="no diagnosis 7 in the store"):
            kept_verdict(session, 7)
        with pytest.raises(LookupError, match="no campaign 'winter'"):
            list_diagnoses(session, "winter")
