"""Every report as a reader sees it: no cell is cut, nothing stands over something else or off the
page, few pages, the units of the bench."""

from __future__ import annotations

import datetime as dt
import re
from collections.abc import Callable, Iterator
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pyroshock.app.common.quantities import shown_in
from pyroshock.app.documents.document import (
    Bullets,
    ChartRow,
    Document,
    Paragraph,
    Table,
    cell_text,
)
from pyroshock.app.documents.page import html_of
from pyroshock.app.documents.pdf import pdf_of
from pyroshock.app.operations.diagnose.report import document_of
from pyroshock.app.operations.report.campaign import campaign_document
from pyroshock.app.operations.report.model import model_document
from pyroshock.app.operations.validate.report import validation_document
from pyroshock.schema.recordings import QualityFinding, Recording
from pyroshock.schema.session import Store
from pyroshock.training.registry.listing import chosen
from sqlalchemy import select
from support.checks.pdf_layout import PlacedLine, lines_of, words_of
from support.records import verdicts
from support.stores.hammer_stores import copied, full_campaign, rows_of
from support.stores.report_stores import ModelLab
from support.stores.stores import ingested, opened

#: Report -> pages that it may have.
PAGES = {
    "campaign": 2,
    "shots": 2,
    "many": 4,
    "model": 2,
    "law": 2,
    "diagnosis": 2,
    "validation": 3,
}
#: Of a page, in points.
MARGIN = 12 / 25.4 * 72
LONG = "a-name-of-a-level-that-is-much-longer-than-any-column-of-a-table-can-be-wide"
Reports = Callable[[str], Document]


@pytest.fixture(scope="module")
def many(tmp_path_factory: pytest.TempPathFactory) -> str:
    """A campaign of fifty configurations, one level with a very long name, and a finding of each
    kind."""
    folder = tmp_path_factory.mktemp("many")
    url = f"sqlite:///{folder / 'lab.db'}"
    rows = [{**row, "batch": LONG if row["run"] == 3 else f"b{row['run']}"} for row in rows_of(50)]
    ingested(url, full_campaign(folder / "many", "many", recordings=50, rows=rows))
    with opened(url) as store:
        _with_findings(store)
    return url


def _with_findings(store: Store) -> None:
    message = (
        "full scale (98066.5 m/s2) reached: run of 3 samples at -98066.5 m/s2 "
        "from 0.4145 s: only a bound"
    )
    with store.writing() as session:
        recordings = session.scalars(select(Recording.id).order_by(Recording.id)).all()
        for number, check in enumerate(
            ("saturation", "clipping", "zero-shift", "velocity", "double-hit")
        ):
            severity = ("reject", "warning", "note")[number % 3]
            for key in recordings[number::2]:
                evidence = {"share": 0.1}
                session.add(
                    QualityFinding(
                        recording_id=key,
                        check=check,
                        severity=severity,
                        message=message,
                        evidence=evidence,
                    )
                )


@pytest.fixture
def reports(fired: Path, filled: Path, many: str, lab: ModelLab, tmp_path: Path) -> Reports:
    """Makes a report of each kind by its name in `PAGES`."""

    def campaign(url: str, name: str) -> Document:
        with opened(url) as store, store.reading() as session:
            return campaign_document(session, name)

    def model(label: str) -> Document:
        registry, read = lab
        return model_document(registry, chosen(registry.versions(), label), read)

    kinds: dict[str, Callable[[], Document]] = {
        "campaign": lambda: campaign(copied(filled, tmp_path), "hits"),
        "shots": lambda: campaign(copied(fired, tmp_path), "spring"),
        "many": lambda: campaign(many, "many"),
        "model": lambda: model("linear@1"),
        "law": lambda: model("hann@1"),
        "diagnosis": lambda: document_of(
            verdicts.gun(pictures=verdicts.pictures()), "1", dt.date(2026, 3, 2)
        ),
        "validation": lambda: validation_document(validation_data()),
    }
    return lambda name: kinds[name]()


def validation_data() -> dict[str, Any]:
    """Of 20 shots, six quantities and the spectra of two sensors, as `validate --json` gives it."""
    rng = np.random.default_rng(0)
    units = {
        "velocity": ("m/s", 12.0), "contact_time": ("s", 6e-4), "peak_force": ("N", 3.2e4),
        "impulse": ("N s", 9.0),
        "peak_acceleration_acceleration_1": ("m/s2", 8e4),
        "peak_acceleration_acceleration_2": ("m/s2", 5e4),
        "srs_acceleration_1": ("m/s2", 1.0), "srs_acceleration_2": ("m/s2", 1.0),
    }  # fmt: skip
    score = {
        "shots": 20, "configurations": 20, "values": 20, "effective_values": 20.0,
        "coverage50": 0.45, "coverage90": 0.40, "coverage90_ci95": [0.19, 0.64],
        "crps": 0.0317,
        "median_abs_error": 0.041, "bias": -0.0001, "sharpness90": 0.2, "pit_histogram": [0.1] * 10,
    }  # fmt: skip
    quantities = [
        {
            "name": name,
            "unit": "dB" if name.startswith("srs") else "ln",
            "quantity_unit": unit,
            **score,
        }
        for name, (unit, _) in units.items()
    ]
    shots = []
    for number in range(20):
        values = {
            name: {
                "measured": size * rng.uniform(0.8, 1.2),
                "predicted": size,
                "low90": 0.8 * size,
                "high90": 1.2 * size,
            }
            for name, (_, size) in units.items()
            if not name.startswith("srs")
        }
        shots.append({"shot": number, "configuration": number, "quantities": values})
    frequency = np.geomspace(100, 1e4, 41).tolist()
    lines = [
        {"frequency_hz": f, "coverage90": 0.8, "median_abs_error": 0.3 + 1e-4 * f}
        for f in frequency
    ]
    return {
        "campaign": "spring", "calibrated": False,
        "verdict": "Not calibrated: the 90 % bands hold only 40 %.",
        "quantities": quantities,
        "failures": [{"sentence": "all shots: the peak force is predicted 36 % too high"}],
        "seen": "the twin predicted each of 5 folds of configurations",
        "left_out": ["run 5: no recording"] * 3,
        "notes": ["spectra: learned from 16 measured shots"], "seconds": 7.31, "shots": shots,
        "lines": {"srs_acceleration_1": lines, "srs_acceleration_2": lines},
    }  # fmt: skip


@pytest.mark.parametrize("name", PAGES)
def test_paper_holds_every_cell_whole_on_few_pages(reports: Reports, name: str) -> None:
    document = reports(name)
    pdf = pdf_of(document)
    text = _squeezed(words_of(pdf))
    for table in tables(document):
        for cell in (*table.columns, *(cell_text(cell) for row in table.rows for cell in row)):
            assert _squeezed(cell) in text, f"{cell!r} of the table {table.caption!r}"
    (width, height), lines = lines_of(pdf)
    assert width < height, "no table needs a page on its side"
    for line in lines:
        assert line.left_x >= MARGIN - 1 and line.right_x <= width - MARGIN + 1, (
            f"{line.text!r} is beyond the margin"
        )
        assert line.top >= MARGIN - 1, f"{line.text!r} is above the page"
        assert line.bottom <= height - MARGIN / 4, f"{line.text!r} is below the page"
    assert max(line.page for line in lines) <= PAGES[name]


@pytest.mark.parametrize("name", PAGES)
def test_no_title_stands_over_another_text(reports: Reports, name: str) -> None:
    document = reports(name)
    titles = {document.title, *(section.title for section in document.sections)}
    titles |= {figure.title for row in charts(document) for figure in row.figures}
    _, lines = lines_of(pdf_of(document))
    first_lines = [
        line for line in lines if any(line.text.startswith(title.split(" ")[0]) for title in titles)
    ]
    heads = [line for line in first_lines if any(_part_of(line.text, title) for title in titles)]
    assert heads
    for first, second in combinations(
        sorted(titles), 2
    ):  # what stands too near is one line to a reader
        assert not any(
            f"{first} {second}" in line.text or f"{second} {first}" in line.text for line in lines
        )
    for head in heads:
        covering = [
            line for line in lines if line is not head and _middle(head).overlaps(_middle(line))
        ]
        assert not covering, f"{head.text!r} and {covering[0].text!r}"


def _part_of(text: str, title: str) -> bool:
    """A title may be broken: its first line is how it begins."""
    return title == text or title.startswith(f"{text} ")


def _middle(line: PlacedLine) -> PlacedLine:
    """Its letters without the room above and below that the font leaves for others."""
    room = 0.25 * (line.bottom - line.top)
    return PlacedLine(
        line.page, line.text, line.left_x, line.top + room, line.right_x, line.bottom - room
    )


def test_two_titles_that_touch_are_found() -> None:
    """The test above can fail: without room between figures their titles run into each other."""
    near = [PlacedLine(1, "pulses", 10, 10, 60, 20), PlacedLine(1, "shots", 59, 10, 80, 20)]
    assert near[0].overlaps(near[1]) and not near[0].overlaps(
        PlacedLine(1, "shots", 61, 10, 80, 20)
    )
    assert not near[0].overlaps(PlacedLine(2, "shots", 10, 10, 60, 20))


@pytest.mark.parametrize("name", PAGES)
def test_numbers_are_in_the_units_of_the_bench_and_in_one_format(
    reports: Reports, name: str
) -> None:
    document = reports(name)
    for text in (words_of(pdf_of(document)), " ".join(_words(document))):
        assert not re.search(r"\de[+-]\d\d", text), "a number with an exponent"
        assert "-0.0 %" not in text and "−0.0 %" not in text and " nan" not in text
        assert not re.search(r"\((N|Pa|s|m/s2|m/s²|m)\)", text), "an SI unit"
    html = html_of(document)
    assert not re.search(r"\((N|Pa|s|m/s2|m/s²)\)", html)
    with shown_in("si"):
        in_si = html_of(reports(name))
    assert re.search(r"(\(s\)|\(Pa\)|\(N\)| s | N )", in_si), "SI was asked for"


@pytest.mark.parametrize("name", PAGES)
def test_reports_say_first_what_follows_from_them(reports: Reports, name: str) -> None:
    document = reports(name)
    assert document.lead.endswith((".", "?")) and len(document.lead) > 30
    assert all(section.blocks for section in document.sections)


def tables(document: Document) -> Iterator[Table]:
    """Those that have rows; of the others a sentence is printed."""
    blocks = [block for section in document.sections for block in section.blocks]
    yield from (block for block in blocks if isinstance(block, Table) and block.rows)


def charts(document: Document) -> Iterator[ChartRow]:
    yield from (
        block
        for section in document.sections
        for block in section.blocks
        if isinstance(block, ChartRow)
    )


def _words(document: Document) -> Iterator[str]:
    yield document.lead
    for block in (block for section in document.sections for block in section.blocks):
        match block:
            case Paragraph():
                yield block.text
            case Bullets():
                yield from block.lines
            case Table():
                yield from (
                    *block.columns,
                    *(cell_text(cell) for row in block.rows for cell in row),
                )


def _squeezed(text: str) -> str:
    """Without spaces and ends of lines: a cell may be broken anywhere."""
    return re.sub(r"\s", "", text)
