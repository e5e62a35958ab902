"""A report is the same on screen and on paper: all its parts, nothing fetched, nothing taken for markup."""

from __future__ import annotations

import datetime as dt
import re

import numpy as np
import pytest
from pyroshock.app.documents import pdf as pdf_module
from pyroshock.app.documents.document import (
    Bars,
    Bullets,
    ChartRow,
    Document,
    Figure,
    Paragraph,
    Section,
    ShareBar,
    Table,
    cell_text,
)
from pyroshock.app.documents.page import html_of
from pyroshock.app.documents.pdf import MissingPdfError, pdf_of
from pyroshock.app.documents.pdf_sheet import column_widths, needed_width
from pyroshock.app.documents.svg import Curve, line_chart, line_keys
from support.checks.pdf_text import pages, pdf_text
from support.checks.well_formed import Page, needs_nothing

HOSTILE = "<script>alert('x')</script>&\"quoted\" <b> \x00\x1b ]]>"


def chart(name: str = "steel") -> Figure:
    x = np.linspace(0, 1, 30)
    curves = [Curve(name, x, np.sin(3 * x), 0, np.full(30, 0.1)), Curve("brass", x, x, 1)]
    return Figure(f"pulse of {name}", line_chart(name, curves, "time (ms)", "force (kN)"), line_keys(curves))


def document(word: str = "spring", rows: int = 3) -> Document:
    """Every kind of block, with `word` wherever a campaign's words can stand."""
    return Document(
        kind="Campaign",
        title=word,
        lead=f"lead of {word}",
        facts={"Operator": word},
        sections=(
            Section(word, (Paragraph(f"said of {word}"), Paragraph("remark", quiet=True))),
            Section("Lines", (Bullets((f"first of {word}", "second"), "none"), Bullets((), "nothing here"))),
            Section("Table", (Table(word, ("name", word), [(word, float(i)) for i in range(rows)]),)),
            Section("Empty", (Table("of nothing", ("a", "b"), (), "No rows."),)),
            Section(
                "Bars",
                (Bars((ShareBar(word, "93 %", 0.0, 0.93, "named", word), ShareBar("x", "1", -1.0, 2.0, "floor"))),),
            ),
            Section("One chart", (ChartRow((chart(word),), (("line-0", word),)),)),
            Section("Charts", (ChartRow((chart(), chart(), chart())),)),
        ),
        date=dt.date(2026, 3, 2),
    )


def test_page_and_paper_hold_every_part_and_words_are_never_markup() -> None:
    assert needs_nothing(Page(html_of(document())))
    assert html_of(document()) == html_of(document())
    assert pdf_of(document()) == pdf_of(document())
    page, paper = Page(html_of(document())).text, pdf_text(pdf_of(document()))
    for part in ("spring", "lead of spring", "Operator", "said of spring", "first of spring", "nothing here",
                 "No rows.", "93 %", "pulse of spring", "time (ms)", "brass"):  # fmt: skip
        for text in (page, paper):
            assert part in text.replace("\xa0", " "), part
    page = html_of(document(HOSTILE))
    assert "<script" not in page and "<b>" not in page
    assert "\x00" not in page and "\x1b" not in page
    assert "<script>alert('x')</script>&\"quoted\" <b>" in Page(page).text
    assert "<script>alert" in pdf_text(pdf_of(document(HOSTILE))).replace(" ", "")


def test_pdf_has_its_date_its_letters_and_long_tables() -> None:
    found = pdf_of(document())
    assert b"/CreationDate (D:20260302000000Z)" in found
    assert b"/Title (Campaign: spring)" in found
    pdf = pdf_of(document("Δv = 5.6 ± 0.1 m/s, ε ≤ 3 σ"))
    assert pdf.count(b"/FontFile2") == 2  # regular and bold are inside
    from pyroshock.app.documents.pdf_sheet import fonts
    from reportlab.pdfbase import pdfmetrics

    letters = pdfmetrics.getFont(fonts()[0]).face.charToGlyph
    assert {ord(letter) for letter in "Δε≤σ±–■●○━╌•"} <= set(letters)
    pdf = pdf_of(document(rows=200))
    assert pages(pdf) > 3
    assert pdf_text(pdf).count("name") >= pages(pdf) - 2


def test_wide_tables_turn_the_page() -> None:
    def box(columns: int) -> bool:
        table = Table("wide", [f"column-{i}" for i in range(columns)], [["incompressible"] * columns])
        found = re.search(
            rb"/MediaBox \[ 0 0 ([\d.]+) ([\d.]+) \]", pdf_of(Document("K", "t", "", {}, [Section("s", [table])]))
        )
        assert found is not None
        return bool(max(found.groups(), key=float) == found[1])

    assert not box(3)
    assert box(12)


@pytest.mark.parametrize("length", [5, 60, 3000])
def test_words_that_do_not_end_stay_on_the_page(length: int) -> None:
    table = Table("t", ("a", "b"), [["x" * length, 1.0], ["y", 2.0]])
    assert pages(pdf_of(Document("K", "t" * length, "", {}, [Section("s", [table])]))) >= 1


def test_columns_fill_no_more_than_the_page() -> None:
    def wide(text: str) -> float:
        return 5.0 * len(text)

    assert sum(column_widths([["a", "b"], ["one", "two"]], 500, wide)) < 60
    assert sum(column_widths([["a", "b"], ["word " * 200, "two"]], 500, wide)) == pytest.approx(500)
    assert sum(column_widths([["a"] * 40, ["wording"] * 40], 500, wide)) == pytest.approx(500)
    number, words = (Table("t", ("a",), [[cell]]) for cell in ("5.62 ± 0.11", "five or less"))
    assert needed_width(number, "Helvetica-Bold") > needed_width(words, "Helvetica-Bold")  # is not broken


def test_columns_of_numbers_are_known_and_cells_told_in_words() -> None:
    def number(*cells: float | str | None) -> bool:
        return Table("t", ("a",), [[cell] for cell in cells]).is_number(0)

    assert number(1.0, None, 2) and number("5.62 ± 0.11", "7") and number("0.1 to 0.2", "-3")
    assert not (number("steel", 3.0) or number("2026-11-22 08:09") or number(None))
    texts = {None: "–", 0.123456: "0.1235", 123456.0: "123500", 12: "12", 1.2e9: "1.2e+09"}
    assert {cell: cell_text(cell) for cell in texts} == texts
    assert cell_text(float("nan")) == "–"


def test_missing_library_is_told_with_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    import sys

    monkeypatch.delitem(sys.modules, "pyroshock.app.documents.pdf_sheet", raising=False)
    monkeypatch.setitem(sys.modules, "reportlab", None)
    for name in [name for name in sys.modules if name.startswith(("reportlab.", "pyroshock.app.documents.pdf"))]:
        monkeypatch.setitem(sys.modules, name, None) if name.startswith("reportlab.") else monkeypatch.delitem(
            sys.modules, name
        )
    with pytest.raises(MissingPdfError, match=r"pyroshock\[web\]"):
        pdf_module.pdf_of(document())
