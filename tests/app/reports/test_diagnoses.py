"""The report on a diagnosis: its page, and one that is kept in the store."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pyroshock import app
from pyroshock.app.documents.document import Bars, ChartRow, Paragraph
from pyroshock.app.documents.page import blocks_html, html_of
from pyroshock.app.documents.pdf import pdf_of
from pyroshock.app.figures.figure import BandSeries, ColourRole, PointSeries
from pyroshock.app.figures.inline_svg import inline_svg
from pyroshock.app.operations.diagnose.diagnosing import keep, report_json
from pyroshock.app.operations.diagnose.place_figure import place_plot
from pyroshock.app.operations.diagnose.report import (
    PLACES,
    SHARES,
    WATERFALL,
    diagnosis_document,
    document_of,
    page,
    verdict_of,
    write_page,
)
from pyroshock.app.operations.diagnose.share_figure import share_figure
from pyroshock.app.operations.diagnose.statements import summary
from pyroshock.app.operations.diagnose.waterfall import waterfall_plot
from pyroshock.diagnosis.verdict import GapSize, Pictures, Verdict
from pyroshock.schema.diagnoses import Diagnosis
from support.checks.pdf_layout import count_pages, words_of
from support.checks.well_formed import Page, needs_nothing
from support.records import verdicts
from support.records.campaigns import gun_campaign
from support.stores.stores import ingested, opened

# --- the page of a diagnosis: whole, well formed, everything escaped, and its bars true to the
# numbers --------------
HOSTILE = "<script>alert('x')</script>&\"quoted\""


PARTS = (
    "Most probably it is the compliance of the insulating layer or",
    "Answer 2 (20 %): contact.plate_compliance, the",
    "93 %",
    "insulator = polymeric", "peak force (contact)", "4 runs at tank pressure 0.3 bar",
    "floor of 2 observables assumed", "there was no error to reduce", "steel, 0.3 bar",
)  # fmt: skip


def test_page_is_whole_and_begins_with_what_to_do_next() -> None:
    parsed_page = Page(page(verdicts.verdict()))
    assert not {tag for tag, _ in parsed_page.elements} & {"script", "link", "img", "iframe"}
    assert not any(
        key in ("src", "href") for _, attributes in parsed_page.elements for key in attributes
    )
    assert [part for part in PARTS if part not in parsed_page.text] == []
    (residual,) = (
        plot
        for section in document_of(verdicts.verdict(), "3", None).sections
        for block in section.blocks
        if isinstance(block, ChartRow)
        for plot in block.figures
        if plot.title == "peak force (contact)"
    )
    noise, before, after = residual.series
    assert (type(noise), noise.role) == (BandSeries, ColourRole.NOISE)
    for points in (before, after):
        # the sixth configuration was not measured
        assert isinstance(points, PointSeries) and np.isfinite(points.y).sum() == 5
    assert parsed_page.text.count("steel, 0.3 bar: ") == 2, "each point says which one it is"
    sentence = "The diagnosis considers only gun.valve_flow (--with), and no other effect."
    whole = Page(page(verdicts.gun(assumptions=(sentence,)))).text
    text = " ".join(whole.split())
    assert f"Restriction {sentence}" in text
    body = text.partition("Diagnosis spring ")[2]
    assert body.startswith(
        "The model error is 42 times the tolerance and 99 times the measurement noise; it arises in"
    )
    assert body.partition("What to do next")[2].startswith(" Adopt these effects")
    assert (
        "3 effects together" in text
        and "gun.valve_flow, the flow resistance of the valve: loss coefficient" in text
    )
    assert (
        text.index("What to do next")
        < text.index("+ flow resistance of the valve")
        < text.index("Causes")
    )
    for part in (
        "the dead volume between valve and projectile",
        "the atmosphere ahead of the projectile",
        "52 to 68\u00a0%",
        "unexplained",
    ):
        assert part in whole, part
    assert "Shares of the effects" not in Page(page(verdicts.verdict())).text
    text = Page(page(verdicts.unknown())).text
    experiment = text.partition("What to do next")[2].partition("How far")[0]
    assert "Fire three repetitions" in experiment and text.count("Fire three repetitions") == 1


def test_residuals_are_per_cent_and_agreement_divides_by_nothing() -> None:
    picture = replace(verdicts.pictures().residuals[0], before=np.full(6, np.log(2.0)), after=None)
    chart = Page(page(verdicts.verdict(pictures=Pictures((), (picture,)))))
    assert "measured over simulated (%)" in chart.text and "configuration 1: 100" in chart.text
    missing = replace(picture, before=np.full(6, np.nan))
    assert "nan" not in page(verdicts.verdict(pictures=Pictures((), (missing,)))).replace(
        "finance", ""
    )
    text = Page(page(replace(verdicts.none(), gap=GapSize("rms", 0.0, 0.0, 0.01, False)))).text
    assert (
        "No pictures are kept with this diagnosis." in text
        and "rms: 0; measurement noise 0," in text
    )
    assert "Above the noise" not in text
    assert (
        "Above the noise, in tolerances: peak, impulse, width 4.1 and shape 0.51."
        in Page(page(verdicts.verdict())).text
    )


def test_words_of_a_campaign_are_escaped() -> None:
    whole = verdicts.verdict()
    stage = replace(whole.where.stage[0], name=HOSTILE)
    curve = replace(whole.pictures.curves[0], title=HOSTILE, x_name=HOSTILE, y_unit=HOSTILE)
    residual = replace(whole.pictures.residuals[0], name=HOSTILE, stage=HOSTILE, unit=HOSTILE)
    hostile = replace(
        whole,
        campaign=HOSTILE,
        simulator=HOSTILE,
        where=replace(whole.where, stage=(stage,), drift=(HOSTILE,)),
        shrinkage=(replace(whole.shrinkage[0], held_out_by=HOSTILE, more={HOSTILE: (1.0, 2.0)}),),
        next_runs=(replace(whole.next_runs[0], why=HOSTILE, settings={HOSTILE: HOSTILE}),),
        assumptions=(HOSTILE,),
        pictures=Pictures((HOSTILE,) * 6, (residual,), (curve,)),
    )
    text = page(hostile)
    assert "<script" not in text and HOSTILE in Page(text).text
    hostile = verdicts.verdict(campaign=HOSTILE, simulator=HOSTILE, assumptions=(HOSTILE,))
    report = document_of(hostile, HOSTILE, None)
    assert "<script" not in html_of(report) and pdf_of(report).startswith(b"%PDF")


def test_page_suits_a_telephone(tmp_path: Path) -> None:
    write_page(verdicts.verdict(), tmp_path / "new" / "page.html")
    text = (tmp_path / "new" / "page.html").read_text(encoding="utf-8")
    assert "width=device-width" in text and "prefers-color-scheme: dark" in text
    assert not re.search(r"(?<!-)width: ?[4-9]\d\dpx", text)


# --- A kept diagnosis is told as it was made; of an older store, from its report alone
# ------------------------------
EVERY = pytest.mark.parametrize(
    "made", [verdicts.verdict(), verdicts.gun(), verdicts.unknown(), verdicts.none()]
)


@EVERY
def test_report_alone_gives_back_what_it_says_and_both_forms_hold_every_part(made: Verdict) -> None:
    report = json.loads(json.dumps(report_json(made)))
    assert report_json(verdict_of(report)) == report
    report = document_of(made, "3", None)
    page, paper = Page(html_of(report)), " ".join(words_of(pdf_of(report)).split())
    assert needs_nothing(page)
    for section in report.sections:
        assert section.title in page.text and section.title in paper
    assert report.lead == summary(made)


def test_pictures_and_bars_are_drawn_of_what_is_kept() -> None:
    report = json.loads(json.dumps(report_json(verdicts.gun())))
    assert [effect.effect for effect in verdict_of(report).effects if effect.named] == [
        "gun.valve_flow", "gun.back_pressure", "gun.blow_by"
    ]  # fmt: skip
    report = document_of(verdicts.verdict(), "3", None)
    (figures,) = (
        block
        for section in report.sections
        for block in section.blocks
        if isinstance(block, ChartRow)
    )
    assert len(figures.figures) == 3
    assert any("measured" in plot.legend() for plot in figures.figures)
    without = document_of(verdicts.verdict(pictures=Pictures()), "3", None)
    paragraphs = [
        block.text
        for section in without.sections
        for block in section.blocks
        if isinstance(block, Paragraph)
    ]
    assert "No pictures are kept with this diagnosis." in paragraphs
    report = document_of(verdicts.verdict(), "3", None)
    (causes,) = (section for section in report.sections if section.title == "Causes")
    (bars,) = causes.blocks
    assert isinstance(bars, Bars)
    assert [(bar.start, bar.end, bar.kind) for bar in bars.bars] == [
        (0.0, 0.93, "named"), (0.0, 0.06, "other"), (0.0, 0.01, "other")
    ]  # fmt: skip


def test_missing_numbers_are_no_obstacle_and_a_missing_part_is_refused() -> None:
    gap = replace(verdicts.verdict().gap, noise_floor=float("nan"))
    report = json.loads(json.dumps(report_json(verdicts.verdict(gap=gap))))
    assert report["gap"]["noise_floor"] is None
    page = html_of(document_of(verdict_of(report), "1", None))
    assert "left:nan" not in page and "93 %" in page
    reports: tuple[dict[str, Any], ...] = ({}, {"causes": []}, {"causes": [{"effects": ["none"]}]})
    for bare in reports:
        with pytest.raises(ValueError, match="diagnose again"):
            verdict_of(bare)


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
        same = section.title not in (
            "Residuals before and after",
            "What to do next",
        )  # why, is a detail
        parts = blocks_html(section.blocks), blocks_html(titles[section.title].blocks)
        assert (parts[0] == parts[1]) is same, section.title


@EVERY
def test_a_diagnosis_is_printed_on_two_pages(made: Verdict) -> None:
    assert count_pages(pdf_of(document_of(made, "3", None))) <= 2


def test_a_printed_report_draws_the_largest_residuals_and_says_how_many_it_leaves_out() -> None:
    pictures = verdicts.pictures()
    sizes = np.linspace(0.01, 0.2, 9)
    many = tuple(
        replace(pictures.residuals[0], name=f"observable {i}", before=np.full(6, size))
        for i, size in enumerate(sizes)
    )
    document = document_of(verdicts.verdict(pictures=replace(pictures, residuals=many)), "3", None)
    text = Page(html_of(document)).text
    assert (
        "observable 8" in text
        and "observable 0" not in text
        and "smaller residuals are drawn" in text
    )


def test_the_pictures_of_the_page_stand_in_the_report() -> None:
    """The waterfall, the shares and the map of places, as on the page, under the same captions."""
    made = verdicts.explored()
    report = document_of(made, "1", None)
    plots = [
        plot
        for section in report.sections
        for block in section.blocks
        if isinstance(block, ChartRow)
        for plot in block.figures
    ]
    titles = [plot.title for plot in plots]
    assert titles[:3] == [
        "What takes the error away",
        "Which effects, and how much",
        "Map of the error",
    ]
    for plot, own in zip(
        plots, (waterfall_plot(made), share_figure(made), place_plot(made)), strict=False
    ):
        assert own is not None
        assert repr((plot.series, plot.x, plot.y)) == repr((own.series, own.x, own.y))
    html = html_of(report)
    assert all(caption in Page(html).text for _, caption in (WATERFALL, SHARES, PLACES))
    page_template = (Path(app.__file__).parent / "web/templates/diagnosis.html").read_text("utf-8")
    assert all(caption in page_template for _, caption in (WATERFALL, PLACES))
    picture = inline_svg(plots[2])
    assert "<image" not in picture, "cells are drawn, for a page may refuse pictures of pixels"
    words = {word.strip() for word in Page(picture).words}
    assert set(plots[2].x.categories) | set(plots[2].y.categories) <= words
    # one of nine is no number, two lie below the tolerance: 6 cells, and those of the key
    assert picture.count("fill: var(--c1)") == 6 + 24
    assert pdf_of(report).startswith(b"%PDF")
