"""The sheet that a report is printed on: page, fonts, and how each part stands on it; tables with
columns as wide as their words ask for, all within the margins."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, BinaryIO
from xml.sax.saxutils import escape

from reportlab.graphics.shapes import Drawing, Rect
from reportlab.lib.colors import HexColor
from reportlab.lib.pagesizes import A4, landscape
from reportlab.lib.styles import ParagraphStyle
from reportlab.pdfbase.pdfmetrics import stringWidth
from reportlab.pdfgen.canvas import Canvas
from reportlab.platypus import (
    CondPageBreak,
    KeepTogether,
    LongTable,
    Paragraph,
    SimpleDocTemplate,
    Spacer,
)
from reportlab.platypus import Paragraph as Words

from .document import ChartRow, Document, ShareBar, Table, cell_text, clean
from .line_styles import light
from .pdf_fonts import font_runs, fonts, marked_letters, width_of
from .svg import HEIGHT, WIDTH


def styles_of(font: str, bold: str) -> dict[str, ParagraphStyle]:
    """How each kind of text stands, by name."""
    ink, quiet = HexColor(light()["ink"]), HexColor(light()["quiet"])
    text = ParagraphStyle(
        "text", fontName=font, fontSize=8, leading=10, textColor=ink, spaceAfter=2
    )
    made = {
        "title": {"fontName": bold, "fontSize": 13, "leading": 16, "spaceAfter": 3},
        "heading": {
            "fontName": bold,
            "fontSize": 9.5,
            "leading": 12,
            "spaceBefore": 7,
            "spaceAfter": 3,
        },
        "figure": {"fontName": bold, "spaceBefore": 2},
        "quiet": {"fontSize": 6.5, "leading": 8, "textColor": quiet},
        "caption": {
            "fontSize": 6.5,
            "leading": 8,
            "textColor": quiet,
            "spaceBefore": 3,
            "spaceAfter": 1,
        },
        "bullet": {"leftIndent": 10, "firstLineIndent": -10, "spaceAfter": 1},
        "remark": {
            "fontSize": 6.5,
            "leading": 8,
            "leftIndent": 10,
            "firstLineIndent": -10,
            "spaceAfter": 1,
        },
        "bar": {"spaceAfter": 0, "spaceBefore": 1.5},
    }
    return {"text": text} | {
        name: ParagraphStyle(name, parent=text, **changed) for name, changed in made.items()
    }


_ROOM = 8.0  # of a cell beside its words
_LONGEST = 120.0


def table_of(table: Table, width: float, font: str, bold: str) -> LongTable:
    """Rows under headings that each page repeats, no wider than `width` points."""
    size, texts = _size(table), _texts(table)
    numbers = [table.is_number(i) for i in range(len(table.columns))]
    styles = [[_style(name, size, number) for number in numbers] for name in (bold, font)]
    cells = [
        [_cell(text, style) for text, style in zip(row, styles[number > 0], strict=True)]
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
        ("TOPPADDING", (0, 0), (-1, -1), 0.5),
        ("BOTTOMPADDING", (0, 0), (-1, -1), 1.5),
    ]
    widths = column_widths(texts, width, _measure(bold, size), _measure(font, size))
    return LongTable(cells, colWidths=widths, repeatRows=1, hAlign="LEFT", style=look, spaceAfter=3)


def _cell(text: str, style: ParagraphStyle) -> Paragraph:
    marked, foreign = marked_letters(escape(text), style.fontName)
    return Paragraph(marked, ParagraphStyle("letters", style, wordWrap="CJK") if foreign else style)


def needed_width(table: Table, font: str, bold: str) -> float:
    """Points across that a table needs without breaking a word."""
    size = _size(table)
    return sum(_needs(_texts(table), _measure(bold, size), _measure(font, size)))


Measure = Callable[[str], float]


def _measure(font: str, size: float) -> Measure:
    return lambda text: width_of(text, font, size)


def column_widths(
    texts: Sequence[Sequence[str]], width: float, of_head: Measure, of_cell: Measure
) -> list[float]:
    """For rows of `texts`, the headings first: none narrower than its longest word where that is
    possible, none wider than its longest cell, and all of them no wider than `width`. `of_head` and
    `of_cell` measure a text."""
    need = _needs(texts, of_head, of_cell)
    longest = [
        max([0.0, *(of_cell(text) for text in cells[1:])]) for cells in zip(*texts, strict=True)
    ]
    want = [max(least, most + _ROOM) for least, most in zip(need, longest, strict=True)]
    spare, missing = width - sum(need), sum(want) - sum(need)
    if spare <= 0:
        return [least * width / sum(need) for least in need]
    share = min(spare / missing, 1.0) if missing > 0 else 0.0
    return [least + share * (most - least) for least, most in zip(need, want, strict=True)]


def _needs(texts: Sequence[Sequence[str]], of_head: Measure, of_cell: Measure) -> list[float]:
    """The longest word of each column; one beyond all measure is broken."""
    needs = []
    for head, *cells in zip(*texts, strict=True):
        words = [of_head(word) for word in head.split(" ")] + [
            of_cell(word) for cell in cells for word in cell.split(" ")
        ]
        needs.append(min(max(words), _LONGEST) + _ROOM)
    return needs


def _size(table: Table) -> float:
    return 8.0 if len(table.columns) <= 8 else 7.0 if len(table.columns) <= 10 else 6.5


def _texts(table: Table) -> list[list[str]]:
    """All cells, the headings first; what stays on one line has no spaces that break."""
    numbers = [table.is_number(i) for i in range(len(table.columns))]
    texts = [[cell_text(name) for name in table.columns]]
    for row in table.rows:
        cells = zip(map(cell_text, row), numbers, strict=True)
        texts.append([text.replace(" ", "\u00a0") if number else text for text, number in cells])
    return texts


def _style(font: str, size: float, right: bool) -> ParagraphStyle:
    colour = HexColor(light()["ink"])
    return ParagraphStyle(
        font,
        fontName=font,
        fontSize=size,
        leading=1.3 * size,
        textColor=colour,
        alignment=2 if right else 0,
    )


MARGIN = 28.0
_PADDING = 6.0  # that ReportLab's frames have
_GAP = 12.0
_SMALLER = 0.78  # a figure of which two stand in a row
_BAR_NAME = 0.5  # of the width: the name of a bar, before its track
_PADDINGS = ("LEFTPADDING", "RIGHTPADDING", "TOPPADDING", "BOTTOMPADDING")


class PdfDocument:
    """One document being printed into a file."""

    def __init__(self, document: Document, into: BinaryIO) -> None:
        self.font, self._bold = fonts()
        self._document = document
        tables = [
            block
            for section in document.sections
            for block in section.blocks
            if isinstance(block, Table)
        ]
        upright = A4[0] - 2 * MARGIN - 2 * _PADDING
        wide = any(needed_width(table, self.font, self._bold) > upright for table in tables)
        self._page: tuple[float, float] = landscape(A4) if wide else A4
        self._styles = styles_of(self.font, self._bold)
        self._template = SimpleDocTemplate(
            into,
            pagesize=self._page,
            leftMargin=MARGIN,
            rightMargin=MARGIN,
            topMargin=MARGIN,
            bottomMargin=MARGIN,
            title=clean(document.name),
            subject=clean(document.lead),
            author="",
            creator="pyroshock",
            lang="en",
            invariant=1,
        )

    @property
    def width(self) -> float:
        """Of what stands on a page, in points."""
        return self._page[0] - 2 * MARGIN - 2 * _PADDING

    def write(self, story: list[Any]) -> None:
        """Set the pages."""
        self._template.build(story, onFirstPage=self._first, onLaterPages=self._later)

    def text(self, markup: str, style: str = "text") -> Any:
        """Words; `markup` is escaped already."""
        look = self._styles[style]
        marked, foreign = marked_letters(markup, look.fontName)
        return Words(
            marked, ParagraphStyle(f"{style} letters", look, wordWrap="CJK") if foreign else look
        )

    @property
    def lines_height(self) -> float:
        """Points that some lines need."""
        return 22.0

    def room(self, height: float) -> Any:
        """The next page begins here where fewer points are left on this one."""
        return CondPageBreak(height)

    def figure_width(self, count: int) -> float:
        """Of one of `count` figures."""
        beside = self._beside(count)
        return (_SMALLER if beside == 2 else 1.0) * (self.width / beside - _GAP)

    def figure_height(self, figures: ChartRow) -> float:
        """Of a chart with its title and its legend."""
        keyed = any(figure.keys for figure in figures.figures) or bool(figures.keys)
        return self.figure_width(len(figures.figures)) * HEIGHT / WIDTH + (50.0 if keyed else 30.0)

    def figures(self, figures: Sequence[Sequence[Any]]) -> list[Any]:
        """Figures beside each other; a single one by itself."""
        if len(figures) == 1:
            return [KeepTogether(list(figures[0])), Spacer(0, _GAP)]
        many = self._beside(len(figures))
        cells = [
            [list(figure) for figure in figures[i : i + many]] for i in range(0, len(figures), many)
        ]
        cells[-1] += [[]] * (many - len(cells[-1]))
        look = [
            ("VALIGN", (0, 0), (-1, -1), "TOP"),
            ("LEFTPADDING", (0, 0), (-1, -1), 0),
            ("RIGHTPADDING", (0, 0), (-1, -1), _GAP),  # between the titles of neighbours
        ]
        return [LongTable(cells, colWidths=[self.width / many] * many, style=look, hAlign="LEFT")]

    def _beside(self, count: int) -> int:
        """Figures in a row: two of few, and three of many or on a page on its side."""
        return 2 if self._page == A4 and count in (1, 2, 4) else 3

    def bar(self, bar: ShareBar) -> list[Any]:
        """A bar on its track, its name and value before it."""
        low, high = (min(max(edge, 0.0), 1.0) for edge in (bar.start, bar.end))
        width = self.width * (1 - _BAR_NAME)
        track = Drawing(width, 9)
        track.add(Rect(0, 0, width, 7, fillColor=HexColor(light()["rule"]), strokeColor=None))
        colour = light()[{"named": "bar"}.get(bar.kind, bar.kind)]
        long = max((high - low) * width, 1.5)
        track.add(
            Rect(
                min(low * width, width - long),
                0,
                long,
                7,
                fillColor=HexColor(colour),
                strokeColor=None,
            )
        )
        name, value, about = (escape(clean(text)) for text in (bar.name, bar.value, bar.about))
        row = LongTable(
            [[self.text(f"{name} &nbsp; <b>{value}</b>", "bar"), track]],
            colWidths=[self.width * _BAR_NAME, width],
            style=[
                ("VALIGN", (0, 0), (-1, -1), "MIDDLE"),
                *((side, (0, 0), (-1, -1), 0) for side in _PADDINGS),
            ],
            hAlign="LEFT",
        )
        note = [self.text(about, "quiet")] if about else []
        note += [self.text(f"•&nbsp; {escape(clean(line))}", "bullet") for line in bar.lines]
        return [self.room(4 * track.height), row, *note]

    def table(self, table: Table) -> Any:
        """Rows under headings that each page repeats."""
        return table_of(table, self.width, self.font, self._bold)

    def _first(self, canvas: Canvas, template: Any) -> None:
        date = self._document.date
        if date is not None:
            canvas.setDateFormatter(lambda *_: f"D:{date:%Y%m%d}000000Z")
        self._later(canvas, template)

    def _later(self, canvas: Canvas, template: Any) -> None:
        canvas.saveState()
        canvas.setFont(self.font, 7)
        canvas.setFillColor(HexColor(light()["quiet"]))
        title = clean(self._document.name)
        while title and width_of(title, self.font, 7) > 0.8 * self.width:
            title = title[: int(0.9 * len(title))]
        x = MARGIN + _PADDING
        for font, piece in font_runs(title, self.font):
            canvas.setFont(font, 7)
            canvas.drawString(x, MARGIN / 2, piece)
            x += stringWidth(piece, font, 7)
        canvas.setFont(self.font, 7)
        canvas.drawRightString(
            self._page[0] - MARGIN - _PADDING, MARGIN / 2, f"page {template.page}"
        )
        canvas.restoreState()
