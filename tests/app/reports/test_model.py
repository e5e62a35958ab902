"""The report on a model: the registry's figures, its errors on held-out pulses, what was decided of it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from pyroshock.app.documents.document import Block, ChartRow, Document, Paragraph, Table
from pyroshock.app.documents.page import html_of
from pyroshock.app.documents.pdf import pdf_of
from pyroshock.app.documents.svg import MOST_POINTS
from pyroshock.app.report.model import model_document, of_all_splits
from pyroshock.dataset.table import PulseTable
from pyroshock.training.evaluation.floor import floor_metrics
from pyroshock.training.fitting.session import train
from pyroshock.training.registry.listing import chosen
from pyroshock.training.registry.promotion import promote
from pyroshock.training.registry.registry import Registry
from support.checks.well_formed import Page, needs_nothing
from support.records.pulse_tables import pulse_table
from support.stores.registries import context_in, fresh_registry, without_figures, without_judging_the_first

Read = Callable[[str], PulseTable]


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> tuple[Registry, Read]:
    """A registry with a law and a statistical model on both splits, one promoted; and the pulses."""
    registry = fresh_registry(tmp_path_factory.mktemp("models"))
    table = pulse_table(np.random.default_rng(1), repetitions=3)
    with pytest.MonkeyPatch.context() as patch:
        without_figures(patch)
        without_judging_the_first(patch)
        train(registry, context_in(registry, table), ["hann", "linear"], ["repetitions", "configurations"])
        promote(registry, "hann", 1, lambda _: table, forced=True, reason="to begin with")
    promote(registry, "linear", 1, lambda _: table, forced=True, reason="to <i>try</i> it")
    return registry, lambda _: table


def report(lab: tuple[Registry, Read], label: str) -> Document:
    registry, read = lab
    return model_document(registry, chosen(registry.versions(), label), read)


def blocks(document: Document, title: str) -> list[Block]:
    (section,) = (section for section in document.sections if section.title == title)
    return list(section.blocks)


def test_figures_are_those_of_the_registry_and_a_law_has_none_of_coverage(lab: tuple[Registry, Read]) -> None:
    registry, _ = lab
    version = chosen(registry.versions(), "linear@1")
    own, other = blocks(report(lab, "linear@1"), "Figures by split")
    assert isinstance(own, Table) and isinstance(other, Table)
    row = next(row for row in own.rows if str(row[0]).startswith("force NRMSE"))
    estimate = version.metrics["force_nrmse"]
    floors = registry.floors(version.dataset.hash, version.seed)
    allowed = [
        floor_metrics(floors["repetitions"], scope)["force_nrmse"].mean for scope in ("configuration", "treatment")
    ]
    assert list(row) == [row[0], estimate.mean, f"{estimate.low:.4g} to {estimate.high:.4g}", *allowed, 0.9932]
    assert "configurations" in other.caption and "repetitions" in own.caption
    table = blocks(report(lab, "hann@1"), "Figures by split")[0]
    assert isinstance(table, Table) and not any("band" in str(row[0]) for row in table.rows)
    held_out = blocks(report(lab, "hann@1"), "On the pulses held out")
    assert any("gives no spread" in block.text for block in held_out if isinstance(block, Paragraph))


def test_predictions_stand_beside_measurements(lab: tuple[Registry, Read]) -> None:
    registry, _ = lab
    charts = [b for b in blocks(report(lab, "linear@1"), "On the pulses held out") if isinstance(b, ChartRow)]
    agreement, coverage = charts
    count = len(registry.held_out(chosen(registry.versions(), "linear@1")).keys)
    assert len(Page(agreement.figures[1].drawing).of("circle")) == count < MOST_POINTS
    tips = set(lab[1]("").tip_material.tolist())
    assert {words for _, words in agreement.keys} == {f"{tip} tip" for tip in tips} and len(tips) > 1
    assert len(Page(coverage.figures[0].drawing).of("polyline")) == 3  # the diagonal, force, contact time


def test_promotions_facts_and_splits_are_those_of_the_registry(lab: tuple[Registry, Read]) -> None:
    (table,) = blocks(report(lab, "linear@1"), "Promotions")
    assert isinstance(table, Table)
    (row,) = table.rows
    assert row[1:4] == ["linear@1", "hann@1", "forced"] and str(row[-2]).startswith("to <i>try</i> it")
    assert len(blocks(report(lab, "hann@1"), "Promotions")[0].rows) == 2
    model_report, version = report(lab, "linear@1"), chosen(lab[0].versions(), "linear@1")
    assert model_report.facts["Dataset hash"] == version.dataset.hash
    assert model_report.facts["Cost"].startswith(f"{version.cost.seconds:.1f} s")
    assert "the model in use for a hammer" in model_report.lead and "not in use" in report(lab, "hann@1").lead
    versions = lab[0].versions()
    for first, second in (("repetitions", "configurations"), ("configurations", "repetitions")):
        records = of_all_splits(versions, chosen(versions, "hann@1", first))
        assert [(record.label, record.split) for record in records] == [("hann@1", first), ("hann@1", second)]


def test_report_is_written_both_ways_and_missing_pulses_are_said(lab: tuple[Registry, Read]) -> None:
    def gone(_: str) -> PulseTable:
        raise LookupError("no dataset 5555 in the store")

    found = model_document(lab[0], chosen(lab[0].versions(), "linear@1"), gone)
    (said,) = blocks(found, "On the pulses held out")
    assert isinstance(said, Paragraph) and "no dataset 5555" in said.text
    found = report(lab, "linear@1")
    page = html_of(found)
    assert needs_nothing(Page(page)) and "<i>try</i>" not in page and pdf_of(found) == pdf_of(report(lab, "linear@1"))
