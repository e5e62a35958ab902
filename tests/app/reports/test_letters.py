"""Letters of every language in a PDF: the fonts come with the product, and no report is refused for
a letter."""

from __future__ import annotations

import re
import unicodedata
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from pyroshock.app.documents import pdf_fonts
from pyroshock.app.documents.document import Bullets, ChartRow, Document, Section, Table
from pyroshock.app.documents.write import report_content
from pyroshock.app.figures.figure import Plot, PlotAxis
from support.checks.pdf_layout import lines_of, picture_of, words_of

#: "Impact test" in languages whose letters are embedded.
LANGUAGES = {
    "Latin": "Größenprüfung Łódź ščřž",
    "Vietnamese": "Thử nghiệm va đập",
    "Greek": "Δοκιμή κρούσης",
    "Cyrillic": "Испытание на удар",
    "simplified Chinese": "冲击试验",
    "traditional Chinese": "衝擊試驗",
    "Japanese": "衝撃試験のプレート",
    "Korean": "충격시험",
}
#: Words with letters that no embedded font has.
LACKING = {"Thai": "ทดสอบ", "emoji": "plate 🔨", "Devanagari": "परीक्षण", "private use": "\ue000"}
CHINESE = LANGUAGES["simplified Chinese"]
PLACES = ["title", "lead", "fact", "heading", "cell", "bullet", "chart"]


def document(word: str) -> Document:
    return Document("Campaign", word, "", {}, [Section(word, [Table(word, (word,), [[word]])])])


def document_with(word: str, place: str) -> Document:
    """A report in which `word` stands at that place alone."""
    words = {name: word if name == place else "x" for name in PLACES}
    chart = Plot("x", PlotAxis(words["chart"], "1"), PlotAxis("f", "1"))
    table = Table("of it", (words["heading"],), [[words["cell"]]])
    section = Section("s", [table, Bullets([words["bullet"]], ""), ChartRow([chart])])
    return Document(
        "Campaign", words["title"], words["lead"], {"Operator": words["fact"]}, [section]
    )


@pytest.fixture(autouse=True)
def no_font_of_the_machine(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whoever asks the machine for its fonts fails."""
    monkeypatch.setattr(
        "matplotlib.font_manager.findSystemFonts", lambda *_, **__: pytest.fail("asked the machine")
    )


@pytest.mark.parametrize("word", LANGUAGES.values(), ids=LANGUAGES)
def test_letters_of_each_language_are_printed(word: str) -> None:
    text = re.sub(r"\s", "", words_of(report_content(document(word), ".pdf")))
    assert text.count(word.replace(" ", "")) >= 4, "title, heading, caption and cell"
    assert pdf_fonts.PLACEHOLDER not in text


@pytest.mark.parametrize("word", ["冲击", "衝撃のプ", "충격"])
def test_what_is_seen_is_ink_in_the_shape_of_each_letter(word: str) -> None:
    """Letters that PDFium finds in the text could still be empty boxes, all alike."""
    pdf = report_content(document(word), ".pdf")
    (_, lines), picture = lines_of(pdf), picture_of(pdf)
    title = max(
        (line for line in lines if line.text == word), key=lambda line: line.bottom - line.top
    )
    ink = picture[_pixels(title.top, title.bottom), _pixels(title.left_x, title.right_x)] < 160
    letters = [part.mean(axis=0).tobytes() for part in np.array_split(ink, len(word), axis=1)]
    assert 0.1 < ink.mean() < 0.7 and len(set(letters)) == len(word)


def _pixels(low: float, high: float) -> slice:
    return slice(int(2 * low), int(2 * high) + 1)


def test_a_letter_beyond_the_basic_plane_has_a_font() -> None:
    assert "𠮷野" in words_of(report_content(document("𠮷野"), ".pdf"))


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("word", [CHINESE, LACKING["Thai"]], ids=["embedded", "lacking"])
def test_every_part_of_a_report_takes_any_letter(word: str, place: str) -> None:
    content = report_content(document_with(word, place), ".pdf")
    shown = word if word == CHINESE else pdf_fonts.PLACEHOLDER * len(word)
    assert shown in re.sub(r"\s", "", words_of(content))
    assert word in report_content(document_with(word, place), ".html").decode()


@pytest.mark.parametrize("word", LACKING.values(), ids=LACKING)
def test_a_letter_that_no_font_has_is_a_box_and_is_named(word: str) -> None:
    text = words_of(report_content(document(word), ".pdf"))
    squeezed = " ".join(text.split())
    assert (
        pdf_fonts.PLACEHOLDER in text
        and "stands in this PDF for characters that its fonts lack" in squeezed
    )
    letter = next(letter for letter in word if ord(letter) > 0xFF)
    assert f"U+{ord(letter):04X} {unicodedata.name(letter, 'without a name')}" in squeezed


def test_many_missing_letters_are_counted_after_the_first() -> None:
    thai = "".join(chr(code) for code in range(0x0E01, 0x0E15))
    (remark,) = pdf_fonts.remarks_on_letters(thai)
    assert remark.count("U+0E") == 8 and "and 12 more" in remark


def test_joiners_and_selectors_that_have_no_picture_leave_no_box() -> None:
    word = "a\u200db\ufe0fc\u202e\U000e0100d"
    assert pdf_fonts.PLACEHOLDER not in words_of(report_content(document(word), ".pdf"))
    assert pdf_fonts.remarks_on_letters(word) == []


def test_arabic_is_joined_and_runs_from_right_to_left() -> None:
    """A letter alone is wider than within its word, and the first one stands at the right."""
    text = words_of(report_content(document("اختبار"), ".pdf"))
    assert pdf_fonts.PLACEHOLDER not in text and "stand" not in text

    def width(word: str) -> float:
        _, lines = lines_of(report_content(Document("K", word, "", {}, []), ".pdf"))
        return max(line.right_x - line.left_x for line in lines if line.page == 1 and line.top > 50)

    assert width("ببب") < 0.8 * width("ب\u200cب\u200cب"), "a non-joiner keeps letters apart"


def test_accents_that_stand_apart_are_joined() -> None:
    """Names of files from a Mac: ü and Hangul in their parts."""
    for word in ("prüfung", "충격"):
        apart = unicodedata.normalize("NFD", word)
        assert apart != word == pdf_fonts.printable(apart)
        assert word in words_of(report_content(document(apart), ".pdf"))


def test_letters_that_languages_share_have_the_shapes_of_the_language() -> None:
    """直 ends in a straight line in Chinese, and in a corner in Japanese."""

    pdfs = [report_content(document(word), ".pdf") for word in ("直", "直試", "直の")]
    _, lines = lines_of(pdfs[0])
    title = max(
        (line for line in lines if line.text == "直"), key=lambda line: line.bottom - line.top
    )
    place = _pixels(title.top, title.bottom), _pixels(title.left_x, title.right_x)
    chinese, alike, japanese = (picture_of(pdf)[place].tobytes() for pdf in pdfs)
    assert chinese == alike != japanese


def test_bold_letters_do_not_make_the_others_bold() -> None:
    """Both weights come of one file, whose state the library keeps."""
    _, lines = lines_of(pdf := report_content(document("冲击试验"), ".pdf"))
    rows = [line for line in lines if line.text == "冲击试验" and line.page == 1]
    head, cell = rows[-2:]
    ink = [
        (
            picture_of(pdf)[_pixels(row.top, row.bottom), _pixels(row.left_x, row.right_x)] < 128
        ).mean()
        for row in (head, cell)
    ]
    assert ink[0] > 1.1 * ink[1]


def test_the_same_letters_give_the_same_bytes_whatever_was_printed_before() -> None:
    first = report_content(document(CHINESE), ".pdf")
    report_content(document(LANGUAGES["Japanese"]), ".pdf")
    assert report_content(document(CHINESE), ".pdf") == first


def test_reports_that_are_made_at_once_have_their_own_letters() -> None:
    words = [
        LANGUAGES["Japanese"],
        CHINESE,
        LANGUAGES["Korean"],
        LANGUAGES["traditional Chinese"],
    ] * 2
    with ThreadPoolExecutor(4) as pool:
        for word, pdf in zip(
            words, pool.map(lambda word: report_content(document(word), ".pdf"), words), strict=True
        ):
            assert words_of(pdf).count(word) >= 4


def test_a_report_of_many_letters_stays_small(tmp_path: Path) -> None:
    """Only the letters that it has are embedded: 400 of 44,810."""
    word = "".join(chr(0x4E00 + 7 * i) for i in range(400))
    assert len(report_content(document(word), ".pdf")) < 600_000
