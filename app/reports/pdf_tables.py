"""Tables on paper: columns as wide as their words ask for, all within the margins."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from xml.sax.saxutils import escape

from reportlab.lib.colors import HexColor
from reportlab.lib.styles import ParagraphStyle
from reportlab.pdfbase.pdfmetrics import stringWidth
from reportlab.platypus import LongTable, Paragraph

from .document import Table, cell_text, clean
from .line_styles import light

_ROOM = 8.0  # of a cell beside its words
_LONGEST = 120.0


def table_of(table: Table, width: float, font: str, bold: str) -> LongTable:
    """Rows under headings that each page repeats, no wider than `width` points."""
    size, texts = _size(table), _texts(table)
    numbers = [table.is_number(i) for i in range(len(table.columns))]
    styles = [[_style(name, size, number) for number in numbers] for name in (bold, font)]
    cells = [
        [Paragraph(escape(text), style) for text, style in zip(row, styles[number > 0], strict=True)]
        for number, row in enumerate(texts)
    ]
    rule = HexColor(light()["rule"])
    look = [
        ("VALIGN", (0, 0), (-1, -1), "TOP"),
        ("VALIGN", (0, 0), (-1, 0), "BOTTOM"),
        ("LINEBELOW", (0, 0), (-1, -1), 0.5, rule),
        ("LINEBELOW", (0, 0), (-1, 0), 1.2, rule),
        ("LEFTPADDING", (0, 0), (-1, -1), 1),
        ("RIGHTPADDING", (0, 0), (-1, -1), 6),
        ("TOPPADDING", (0, 0), (-1, -1), 1.5),
        ("BOTTOMPADDING", (0, 0), (-1, -1), 2.5),
    ]
    widths = column_widths(texts, width, lambda text: float(stringWidth(text, bold, size)))
    return LongTable(cells, colWidths=widths, repeatRows=1, hAlign="LEFT", style=look, spaceAfter=8)


def needed_width(table: Table, bold: str) -> float:
    """Points across that a table needs without breaking a word."""
    return sum(_needs(_texts(table), lambda text: float(stringWidth(text, bold, _size(table)))))


def column_widths(texts: Sequence[Sequence[str]], width: float, wide: Callable[[str], float]) -> list[float]:
    """For rows of `texts`, the headings first: none narrower than its longest word where that is possible, none wider
    than its longest cell, and all of them no wider than `width`. `wide` measures a text."""
    need = _needs(texts, wide)
    longest = [max([0.0, *(wide(text) for text in cells[1:])]) for cells in zip(*texts, strict=True)]
    want = [max(least, most + _ROOM) for least, most in zip(need, longest, strict=True)]
    spare, missing = width - sum(need), sum(want) - sum(need)
    if spare <= 0:
        return [least * width / sum(need) for least in need]
    share = min(spare / missing, 1.0) if missing > 0 else 0.0
    return [least + share * (most - least) for least, most in zip(need, want, strict=True)]


def _needs(texts: Sequence[Sequence[str]], wide: Callable[[str], float]) -> list[float]:
    """The longest word of each column; one beyond all measure is broken."""
    columns = zip(*texts, strict=True)
    return [min(max(wide(word) for text in cells for word in text.split(" ")), _LONGEST) + _ROOM for cells in columns]


def _size(table: Table) -> float:
    return 8.0 if len(table.columns) <= 8 else 7.0


def _texts(table: Table) -> list[list[str]]:
    """All cells, the headings first; what stays on one line has no spaces that break."""
    numbers = [table.is_number(i) for i in range(len(table.columns))]
    texts = [[clean(name) for name in table.columns]]
    for row in table.rows:
        cells = zip(map(cell_text, row), numbers, strict=True)
        texts.append([text.replace(" ", "\u00a0") if number else text for text, number in cells])
    return texts


def _style(font: str, size: float, right: bool) -> ParagraphStyle:
    colour = HexColor(light()["ink"])
    return ParagraphStyle(
        font, fontName=font, fontSize=size, leading=1.3 * size, textColor=colour, alignment=2 if right else 0
    )
