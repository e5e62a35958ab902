"""A kept diagnosis is told as it was made; of an older store, from its report alone."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest
from pyroshock.app.diagnose.diagnosing import keep, report_json
from pyroshock.app.diagnose.report import diagnosis_document, document_of, verdict_of
from pyroshock.app.diagnose.summary import summary
from pyroshock.app.documents.document import Bars, ChartRow, Paragraph
from pyroshock.app.documents.page import html_of
from pyroshock.app.documents.pdf import pdf_of
from pyroshock.diagnosis.verdict import Pictures, Verdict
from pyroshock.schema.diagnoses import Diagnosis
from support.checks.pdf_text import pdf_text
from support.checks.well_formed import Page, needs_nothing
from support.records import verdicts
from support.records.campaigns import gun_campaign
from support.stores.stores import ingested, opened

HOSTILE = "<script>alert('x')</script>&\"quoted\""


@pytest.mark.parametrize("made", [verdicts.verdict(), verdicts.gun(), verdicts.unknown(), verdicts.none()])
def test_report_alone_gives_back_what_it_says(made: Verdict) -> None:
    report = json.loads(json.dumps(report_json(made)))
    assert report_json(verdict_of(report)) == report


def test_report_alone_names_the_effects_of_its_first_entry() -> None:
    report = json.loads(json.dumps(report_json(verdicts.gun())))
    assert [effect.effect for effect in verdict_of(report).effects if effect.named] == [
        "gun.valve_flow", "gun.back_pressure", "gun.blow_by"
    ]  # fmt: skip


def test_missing_numbers_are_no_obstacle() -> None:
    gap = replace(verdicts.verdict().gap, noise_floor=float("nan"))
    report = json.loads(json.dumps(report_json(verdicts.verdict(gap=gap))))
    assert report["gap"]["noise_floor"] is None
    page = html_of(document_of(verdict_of(report), "1", None))
    assert "left:nan" not in page and "93 %" in page


@pytest.mark.parametrize("made", [verdicts.verdict(), verdicts.gun(), verdicts.unknown(), verdicts.none()])
def test_both_hold_every_part(made: object) -> None:
    verdict = made
    found = document_of(verdict, "3", None)
    page, paper = Page(html_of(found)), pdf_text(pdf_of(found))
    assert needs_nothing(page)
    for section in found.sections:
        assert section.title in page.text and section.title in paper
    assert found.lead == summary(verdict)


def test_pictures_are_drawn_where_they_are_kept() -> None:
    found = document_of(verdicts.verdict(), "3", None)
    (figures,) = (block for section in found.sections for block in section.blocks if isinstance(block, ChartRow))
    assert len(figures.figures) == 3
    assert ("measured", "measured") in figures.keys
    without = document_of(verdicts.verdict(pictures=Pictures()), "3", None)
    said = [block.text for section in without.sections for block in section.blocks if isinstance(block, Paragraph)]
    assert "No pictures are kept with this diagnosis." in said


def test_bars_are_as_long_as_the_probabilities() -> None:
    found = document_of(verdicts.verdict(), "3", None)
    (causes,) = (section for section in found.sections if section.title == "Causes")
    (bars,) = causes.blocks
    assert isinstance(bars, Bars)
    assert [(bar.start, bar.end, bar.kind) for bar in bars.bars] == [
        (0.0, 0.93, "named"), (0.0, 0.06, "other"), (0.0, 0.01, "other")
    ]  # fmt: skip


def test_words_of_a_campaign_are_no_markup() -> None:
    hostile = verdicts.verdict(campaign=HOSTILE, simulator=HOSTILE, assumptions=(HOSTILE,))
    found = document_of(hostile, HOSTILE, None)
    assert "<script" not in html_of(found)
    assert pdf_of(found).startswith(b"%PDF")


@pytest.mark.parametrize("report", [{}, {"causes": []}, {"causes": [{"effects": ["none"]}]}])
def test_report_that_lacks_a_part_is_refused(report: dict[str, object]) -> None:
    with pytest.raises(ValueError, match="diagnose again"):
        verdict_of(report)


def test_kept_diagnoses_are_read_with_and_without_details(tmp_path) -> None:
    url = f"sqlite:///{tmp_path / 'lab.db'}"
    ingested(url, gun_campaign(tmp_path / "spring", name="spring"))
    with opened(url) as store:
        key = keep(store, verdicts.verdict())
        with store.reading() as session:
            whole = diagnosis_document(session, key)
        with store.writing() as session:
            session.get_one(Diagnosis, key).details = None
        with store.reading() as session:
            bare = diagnosis_document(session, key)
            with pytest.raises(LookupError, match="no diagnosis 99"):
                diagnosis_document(session, 99)
    titles = {section.title: section for section in bare.sections}
    for section in whole.sections:
        same = section.title != "Residuals before and after"
        assert (section.blocks == titles[section.title].blocks) is same, section.title
