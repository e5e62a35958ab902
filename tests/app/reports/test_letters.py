"""Letters that DejaVu lacks: a PDF embeds a font of the machine that has them, or is refused with what to install."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import matplotlib
import pytest
from pyroshock.app.documents.document import Bullets, ChartRow, Document, Figure, Section, Table
from pyroshock.app.documents.svg import line_chart
from pyroshock.app.documents.write import check_letters, report_content
from support.checks.pdf_layout import words_of

pdf_sheet = pytest.importorskip("pyroshock.app.documents.pdf_sheet", reason="no reportlab")
CHINESE = "冲击试验"


def document(word: str) -> Document:
    return Document("Campaign", word, "", {}, [Section(word, [Table(word, (word,), [[word]])])])


@pytest.fixture(autouse=True)
def fresh() -> Iterator[None]:
    """What was found of other fonts is forgotten before and after."""
    _forget()
    yield
    _forget()


def _forget() -> None:
    pdf_sheet._other_fonts.cache_clear()
    pdf_sheet._font_of.cache_clear()


def fonts(monkeypatch: pytest.MonkeyPatch, *paths: Path) -> None:
    monkeypatch.setattr("matplotlib.font_manager.findSystemFonts", lambda: [str(path) for path in paths])


def test_without_a_font_a_report_is_refused_before_its_work(monkeypatch: pytest.MonkeyPatch) -> None:
    fonts(monkeypatch)
    with pytest.raises(pdf_sheet.MissingLettersError, match=r"冲击.*fonts-droid-fallback.*or write the report as HTML"):
        check_letters(".pdf", CHINESE)
    check_letters(".html", CHINESE)
    check_letters(".pdf", "Größe µ")


@pytest.mark.parametrize("place", ["title", "lead", "fact", "heading", "cell", "bullet", "chart"])
def test_letters_of_every_part_are_checked(monkeypatch: pytest.MonkeyPatch, place: str) -> None:
    """Before the layout begins, wherever the letters stand."""
    fonts(monkeypatch)
    words = {name: CHINESE if name == place else "x" for name in ("title", "lead", "fact", "heading", "cell", "bullet")}
    chart = line_chart(CHINESE if place == "chart" else "x", [], "t", "f")
    table = Table("of it", (words["heading"],), [[words["cell"]]])
    section = Section("s", [table, Bullets([words["bullet"]], ""), ChartRow([Figure("x", chart)])])
    report = Document("Campaign", words["title"], words["lead"], {"Operator": words["fact"]}, [section])
    monkeypatch.setattr("pyroshock.app.documents.write._pdf", lambda _: pytest.fail("wrote before it looked"))
    with pytest.raises(pdf_sheet.MissingLettersError):
        report_content(report, ".pdf")
    assert CHINESE in report_content(report, ".html").decode()


def test_a_damaged_font_is_passed_over(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    (tmp_path / "damaged.ttf").write_bytes(b"no font")
    fonts(monkeypatch, tmp_path / "damaged.ttf", tmp_path / "missing.ttf")
    with pytest.raises(pdf_sheet.MissingLettersError):
        pdf_sheet.check_letters(CHINESE)


def test_letters_of_another_font_are_marked_with_it(monkeypatch: pytest.MonkeyPatch) -> None:
    font = Path(matplotlib.get_data_path()) / "fonts" / "ttf" / "STIXGeneral.ttf"
    own = pdf_sheet._own_letters()
    monkeypatch.setattr(pdf_sheet, "_own_letters", lambda: own - {ord("≤")})
    fonts(monkeypatch, font)
    assert pdf_sheet.marked_letters("a ≤ b") == 'a <font name="letters-STIXGeneral">≤</font> b'
    assert report_content(document("a ≤ b"), ".pdf").startswith(b"%PDF")


@pytest.mark.parametrize("word", [CHINESE, "衝撃試験のプレート"])
def test_letters_that_a_font_of_this_machine_has_are_printed(word: str) -> None:
    try:
        pdf_sheet.check_letters(word)
    except pdf_sheet.MissingLettersError:
        pytest.skip("no font of this machine has Chinese and Japanese letters (fonts-droid-fallback has)")
    text = words_of(report_content(document(word), ".pdf"))
    assert text.count(word) >= 4, "title, heading, caption and cell"
