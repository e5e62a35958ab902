"""The report on a model: the registry's figures, its errors on held-out pulses, what was decided of
it."""

from __future__ import annotations

import re
from dataclasses import replace

import pytest
from pyroshock.app.common.number_format import format_number
from pyroshock.app.common.quantities import shown_in
from pyroshock.app.documents.document import Block, Bullets, ChartRow, Document, Paragraph, Table
from pyroshock.app.documents.page import html_of
from pyroshock.app.documents.pdf import pdf_of
from pyroshock.app.figures.agreement import MOST_POINTS
from pyroshock.app.figures.figure import LineSeries, PointSeries
from pyroshock.app.operations.report.model import model_document, of_all_splits
from pyroshock.app.operations.train.wording import share, share_with_range
from pyroshock.dataset.table import PulseTable
from pyroshock.training.evaluation.floor import floor_metrics
from pyroshock.training.evaluation.summary import Estimate
from pyroshock.training.registry.listing import chosen
from support.checks.well_formed import Page, needs_nothing
from support.stores.report_stores import ModelLab


def report(lab: ModelLab, label: str) -> Document:
    registry, read = lab
    return model_document(registry, chosen(registry.versions(), label), read)


def blocks(document: Document, title: str) -> list[Block]:
    (section,) = (section for section in document.sections if section.title == title)
    return list(section.blocks)


def test_figures_are_those_of_the_registry_and_a_law_has_none_of_coverage(lab: ModelLab) -> None:
    registry, _ = lab
    version = chosen(registry.versions(), "linear@1")
    (table,) = blocks(report(lab, "linear@1"), "Figures by split")
    assert isinstance(table, Table)
    assert table.columns[1::2] == [
        "repetitions: error (90 % interval)",
        "configurations: error (90 % interval)",
        "thesis",
    ]
    row = next(row for row in table.rows if row[0] == "rms error of the force, of its range")
    estimate = version.metrics["force_nrmse"]
    floor = floor_metrics(
        registry.floors(version.dataset.hash, version.seed)["repetitions"], "configuration"
    )
    expected = share_with_range({"mean": estimate.mean, "ci90": [estimate.low, estimate.high]})
    assert list(row[:3]) == [row[0], expected, share(floor["force_nrmse"].mean)] and row[
        -1
    ] == share(0.9932)
    force = next(row for row in table.rows if row[0] == "rms error of the force")
    newton = version.metrics["force_rmse_n"].mean
    assert str(force[1]).startswith(f"{format_number(1e-3 * newton, 2)} kN (")
    with shown_in("si"):
        (in_si,) = blocks(report(lab, "linear@1"), "Figures by split")
        words = next(row for row in in_si.rows if row[0] == "rms error of the force")[1]
        assert str(words).startswith(f"{format_number(newton, 2)} N (")
    (table,) = blocks(report(lab, "hann@1"), "Figures by split")
    assert isinstance(table, Table) and not any("band" in str(row[0]) for row in table.rows)
    held_out = blocks(report(lab, "hann@1"), "On the pulses held out")
    assert any(
        "gives no spread" in block.text for block in held_out if isinstance(block, Paragraph)
    )


def test_report_begins_with_what_the_model_is_good_for(lab: ModelLab) -> None:
    lead = report(lab, "linear@1").lead
    assert lead.startswith("linear@1 is not usable: its force error on the split ")
    assert " kN (" in lead
    assert "Its 90 % bands " in lead and "force points" in lead
    assert lead.endswith("It is the model in use for a hammer.")
    law = report(lab, "hann@1")
    assert "It gives no bands. " in law.lead and "linear@1 is in use for a hammer. " in law.lead
    assert re.search(
        r"(linear@1 and hann@1|hann@1 and linear@1) cannot be told apart|is better than", law.lead
    )
    (table,) = blocks(law, "Compared with the model in use")
    assert isinstance(table, Table) and table.columns[1:3] == ("hann@1", "linear@1 (in use)")
    assert "Compared with the model in use" not in [
        section.title for section in report(lab, "linear@1").sections
    ]


@pytest.mark.parametrize(("interval", "words"), [
    ((0.5, 0.6, 0.7), "Its 90 % bands are too narrow for the force points"),
    ((0.95, 0.97, 0.99), "Its 90 % bands are wider than necessary for the force points"),
    ((0.8, 0.88, 0.95), "which agrees with what they promise"),
])  # fmt: skip
def test_coverage_is_judged_by_its_interval(
    lab: ModelLab, interval: tuple[float, ...], words: str
) -> None:
    low, mean, high = interval
    version = chosen(lab[0].versions(), "linear@1")
    metrics = {
        name: estimate for name, estimate in version.metrics.items() if name != "time_covered"
    }
    version = replace(version, metrics=metrics | {"force_covered": Estimate(mean, low, high)})
    assert words in model_document(lab[0], version, lab[1]).lead


def test_predictions_stand_beside_measurements(lab: ModelLab) -> None:
    registry, _ = lab
    (charts,) = [
        b
        for b in blocks(report(lab, "linear@1"), "On the pulses held out")
        if isinstance(b, ChartRow)
    ]
    count = len(registry.held_out(chosen(registry.versions(), "linear@1")).keys)
    _, contact_time, coverage = charts.figures
    clouds = [series for series in contact_time.series if isinstance(series, PointSeries)]
    assert sum(len(cloud.x) for cloud in clouds) == count < MOST_POINTS
    assert (contact_time.x.heading, contact_time.x.scale) == ("measured (ms)", "log")
    tips = set(lab[1]("").tip_material.tolist())
    assert set(contact_time.legend()) == {f"{tip} tip" for tip in tips} and len(tips) > 1
    equal, *curves = coverage.series
    assert [curve.name for curve in curves] == ["force", "contact time"]
    assert isinstance(equal, LineSeries)
    assert equal.x.tolist() == equal.y.tolist(), "the diagonal"


def test_decisions_origin_and_splits_are_those_of_the_registry(lab: ModelLab) -> None:
    (table,) = blocks(report(lab, "linear@1"), "Decisions")
    assert isinstance(table, Table)
    (row,) = table.rows
    assert row[1] == "linear@1 is promoted by force; hann@1 was in use before"
    assert str(row[-2]).startswith("to <i>try</i> it")
    assert len(blocks(report(lab, "hann@1"), "Decisions")[0].rows) == 2
    model_report, version = report(lab, "linear@1"), chosen(lab[0].versions(), "linear@1")
    (origin,) = blocks(model_report, "Origin")
    assert isinstance(origin, Bullets) and any(
        version.dataset.hash in line for line in origin.lines
    )
    assert model_report.facts["Judged on"] == "repetitions, configurations"
    versions = lab[0].versions()
    for first, second in (("repetitions", "configurations"), ("configurations", "repetitions")):
        records = of_all_splits(versions, chosen(versions, "hann@1", first))
        assert [(record.label, record.split) for record in records] == [
            ("hann@1", first),
            ("hann@1", second),
        ]


def test_report_is_written_both_ways_and_missing_pulses_are_said(lab: ModelLab) -> None:
    def gone(_: str) -> PulseTable:
        raise LookupError("no dataset 5555 in the store")

    found = model_document(lab[0], chosen(lab[0].versions(), "linear@1"), gone)
    (said,) = blocks(found, "On the pulses held out")
    assert isinstance(said, Paragraph) and "no dataset 5555" in said.text
    found = report(lab, "linear@1")
    page = html_of(found)
    assert (
        needs_nothing(Page(page))
        and "<i>try</i>" not in page
        and pdf_of(found) == pdf_of(report(lab, "linear@1"))
    )
