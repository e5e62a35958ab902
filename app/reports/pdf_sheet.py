"""The sheet that a report is printed on: page, fonts, and how each part stands on it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, BinaryIO
from xml.sax.saxutils import escape

from reportlab.graphics.shapes import Drawing, Rect
from reportlab.lib.colors import HexColor
from reportlab.lib.pagesizes import A4, landscape
from reportlab.pdfgen.canvas import Canvas
from reportlab.platypus import CondPageBreak, KeepTogether, LongTable, SimpleDocTemplate, Spacer
from reportlab.platypus import Paragraph as Words

from .document import ChartRow, Document, ShareBar, Table, clean
from .line_styles import light
from .pdf_fonts import fonts, styles_of
from .pdf_tables import needed_width, table_of
from .svg import HEIGHT, WIDTH

_MARGIN = 48.0
_PADDING = 6.0  # that ReportLab's frames have
_GAP = 12.0
_ALONE = 300.0  # a figure by itself


class PdfDocument:
    """One document being printed into a file."""

    def __init__(self, document: Document, into: BinaryIO) -> None:
        self.font, self._bold = fonts()
        self._document = document
        tables = [block for section in document.sections for block in section.blocks if isinstance(block, Table)]
        upright = A4[0] - 2 * _MARGIN - 2 * _PADDING
        wide = any(needed_width(table, self._bold) > upright for table in tables)
        self._page: tuple[float, float] = landscape(A4) if wide else A4
        self._styles = styles_of(self.font, self._bold)
        self._template = SimpleDocTemplate(
            into,
            pagesize=self._page,
            leftMargin=_MARGIN,
            rightMargin=_MARGIN,
            topMargin=_MARGIN,
            bottomMargin=_MARGIN,
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
        return self._page[0] - 2 * _MARGIN - 2 * _PADDING

    def write(self, story: list[Any]) -> None:
        """Set the pages."""
        self._template.build(story, onFirstPage=self._first, onLaterPages=self._later)

    def text(self, markup: str, style: str = "text") -> Any:
        """Words; `markup` is escaped already."""
        return Words(markup, self._styles[style])

    def room(self, height: float) -> Any:
        """The next page begins here where fewer points are left on this one."""
        return CondPageBreak(height)

    def figure_width(self, count: int) -> float:
        """Of one of `count` figures."""
        return self.width / self._beside - _GAP if count > 1 else _ALONE

    def figure_height(self, figures: ChartRow) -> float:
        """Of a chart with its title and its legend."""
        keyed = any(figure.keys for figure in figures.figures) or bool(figures.keys)
        return self.figure_width(len(figures.figures)) * HEIGHT / WIDTH + (50.0 if keyed else 30.0)

    def figures(self, figures: Sequence[Sequence[Any]]) -> list[Any]:
        """Figures beside each other; a single one by itself."""
        if len(figures) == 1:
            return [KeepTogether(list(figures[0])), Spacer(0, _GAP)]
        many = self._beside
        cells = [[list(figure) for figure in figures[i : i + many]] for i in range(0, len(figures), many)]
        cells[-1] += [[]] * (many - len(cells[-1]))
        look = [
            ("VALIGN", (0, 0), (-1, -1), "TOP"),
            ("LEFTPADDING", (0, 0), (-1, -1), 0),
            ("RIGHTPADDING", (0, 0), (-1, -1), 0),
        ]
        return [LongTable(cells, colWidths=[self.width / many] * many, style=look, hAlign="LEFT")]

    @property
    def _beside(self) -> int:
        """Figures in a row: two on an upright page, three on one on its side."""
        return 2 if self._page == A4 else 3

    def bar(self, bar: ShareBar) -> list[Any]:
        """A bar on its track, its name and value above."""
        low, high = (min(max(edge, 0.0), 1.0) for edge in (bar.start, bar.end))
        track = Drawing(self.width, 10)
        track.add(Rect(0, 0, self.width, 8, fillColor=HexColor(light()["rule"]), strokeColor=None))
        colour = light()[{"named": "bar"}.get(bar.kind, bar.kind)]
        long = max((high - low) * self.width, 1.5)
        track.add(
            Rect(min(low * self.width, self.width - long), 0, long, 8, fillColor=HexColor(colour), strokeColor=None)
        )
        name, value, about = (escape(clean(text)) for text in (bar.name, bar.value, bar.about))
        note = [self.text(about, "quiet")] if about else []
        return [self.room(4 * track.height), self.text(f"{name} &nbsp; <b>{value}</b>", "bar"), track, *note]

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
        while title and canvas.stringWidth(title, self.font, 7) > 0.8 * self.width:
            title = title[: int(0.9 * len(title))]
        canvas.drawString(_MARGIN + _PADDING, _MARGIN / 2, title)
        canvas.drawRightString(self._page[0] - _MARGIN - _PADDING, _MARGIN / 2, f"page {template.page}")
        canvas.restoreState()
