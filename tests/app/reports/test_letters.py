"""Letters that DejaVu lacks: a PDF embeds a font of the machine that has them, or is refused with what to install."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import matplotlib
import pytest
from pyroshock.app.documents.document import Document, Section, Table
from pyroshock.app.documents.write import check_letters

pdf_sheet = pytest.importorskip("pyroshock.app.documents.pdf_sheet", reason="no reportlab")
CHINESE = "冲击试验"


def document(word: str) -> Document:
    return Document("Campaign", word, "", {}, [Section(word, [Table(word, (word,), [[word]])])])


@pytest.fixture(autouse=True)
def fresh() -> Iterator[None]:
    """What was found of other fonts is forgotten before and after."""
    pdf_sheet._font_with.cache_clear()
    yield
    pdf_sheet._font_with.cache_clear()


def fonts(monkeypatch: pytest.MonkeyPatch, *paths: Path) -> None:
    monkeypatch.setattr("matplotlib.font_manager.findSystemFonts", lambda: [str(path) for path in paths])


def test_without_a_font_a_report_is_refused_before_its_work(monkeypatch: pytest.MonkeyPatch) -> None:
    fonts(monkeypatch)
    with pytest.raises(pdf_sheet.MissingLettersError, match="or write the report as HTML"):
        check_letters(Path("report.pdf"), CHINESE)
    check_letters(Path("report.html"), CHINESE)
    check_letters(Path("report.pdf"), "Größe µ")


def test_a_damaged_font_is_passed_over(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    (tmp_path / "damaged.ttf").write_bytes(b"no font")
    fonts(monkeypatch, tmp_path / "damaged.ttf", tmp_path / "missing.ttf")
    with pytest.raises(pdf_sheet.MissingLettersError):
        pdf_sheet.letters_font(CHINESE)


def test_letters_of_another_font_are_marked_with_it(monkeypatch: pytest.MonkeyPatch) -> None:
    font = Path(matplotlib.get_data_path()) / "fonts" / "ttf" / "STIXGeneral.ttf"
    own = pdf_sheet._own_letters()
    monkeypatch.setattr(pdf_sheet, "_own_letters", lambda: own - {ord("≤")})
    fonts(monkeypatch, font)
    assert pdf_sheet.marked_letters("a ≤ b") == 'a <font name="letters-STIXGeneral">≤</font> b'
    from pyroshock.app.documents.pdf import pdf_of

    assert pdf_of(document("a ≤ b")).startswith(b"%PDF")
