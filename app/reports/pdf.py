"""A report as a PDF for print: A4, its own fonts in it, and the same bytes for the same report."""

from __future__ import annotations

from collections.abc import Sequence
from io import BytesIO
from typing import TYPE_CHECKING, Any
from xml.sax.saxutils import escape

from .document import Bars, Block, Bullets, ChartRow, Document, Figure, Paragraph, Table, clean
from .line_styles import inks, light

if TYPE_CHECKING:
    from .pdf_sheet import PdfDocument


#: Of some lines, in points.
_HEIGHT = 36.0


class MissingPdfError(ValueError):
    """The library that writes PDFs is not installed."""


def pdf_of(document: Document) -> bytes:
    """The PDF. Raises `MissingPdfError` where ReportLab is not installed."""
    try:
        from .pdf_sheet import PdfDocument
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] != "reportlab":
            raise
        raise MissingPdfError(
            "reportlab is not installed; reports as PDF need it: pip install 'pyroshock[web]' (or --out FILE.html)"
        ) from error
    into = BytesIO()
    sheet = PdfDocument(document, into)
    sheet.write(_story(document, sheet))
    return into.getvalue()


def _story(document: Document, sheet: PdfDocument) -> list[Any]:
    story = [sheet.text(_safe(document.kind.upper()), "quiet"), sheet.text(_safe(document.title), "title")]
    if document.lead:
        story.append(sheet.text(_safe(document.lead)))
    facts = "<br/>".join(
        f'<font color="{light()["quiet"]}">{_safe(name)}</font>&nbsp; {_safe(value)}'
        for name, value in document.facts.items()
    )
    story.append(sheet.text(facts))
    for section in document.sections:
        blocks = section.blocks or (Paragraph("None.", quiet=True),)
        story += [sheet.room(_start(blocks, sheet)), sheet.text(_safe(section.title), "heading")]
        for block in blocks:
            story += _flowables(block, sheet)
    return story


def _start(blocks: Sequence[Block], sheet: PdfDocument) -> float:
    """Points that a heading needs: up to the first rows or charts, from which no page break should part it."""
    height = _HEIGHT
    for block in blocks:
        if not isinstance(block, Paragraph):
            return height + (sheet.figure_height(block) if isinstance(block, ChartRow) else 2 * _HEIGHT)
        height += _HEIGHT
    return height


def _safe(text: str) -> str:
    return escape(clean(text))


def _flowables(block: Block, sheet: PdfDocument) -> list[Any]:
    match block:
        case Paragraph():
            return [sheet.text(_safe(block.text), "quiet" if block.quiet else "text")]
        case Bullets():
            lines = [sheet.text(f"•&nbsp; {_safe(line)}", "bullet") for line in block.lines]
            return lines or [sheet.text(_safe(block.empty), "quiet")]
        case Table():
            return _table(block, sheet)
        case Bars():
            return [part for bar in block.bars for part in sheet.bar(bar)]
        case ChartRow():
            keys = [sheet.text(_keys(block.keys), "quiet")] if block.keys else []
            figures = [_figure(figure, sheet, len(block.figures)) for figure in block.figures]
            return [sheet.room(sheet.figure_height(block)), *keys, *sheet.figures(figures)]


def _table(table: Table, sheet: PdfDocument) -> list[Any]:
    if not table.rows:
        return [sheet.text(_safe(table.empty), "quiet")]
    return [sheet.room(2 * _HEIGHT), sheet.text(_safe(table.caption), "caption"), sheet.table(table)]


def _figure(figure: Figure, sheet: PdfDocument, count: int) -> list[Any]:
    from .pdf_drawing import drawing_of

    drawing = drawing_of(figure.drawing, sheet.font, sheet.figure_width(count))
    keys = [sheet.text(_keys(figure.keys), "quiet")] if figure.keys else []
    return [sheet.text(_safe(figure.title), "figure"), drawing, *keys]


def _keys(keys: Sequence[tuple[str, str]]) -> str:
    """The marks of a legend in their colours."""
    return " &nbsp;&nbsp; ".join(
        f'<font color="{_colour(kind)}">{_sign(kind)}</font>&nbsp;{_whole(words)}' for kind, words in keys
    )


def _whole(words: str) -> str:
    """Some words that no line ends within; many."""
    return _safe(words.replace(" ", "\u00a0") if len(words) <= 40 else words)


def _colour(kind: str) -> str:
    name = "measured-line" if kind == "measured" else kind
    return inks()[name].stroke or inks()[name].fill or light()["ink"]


def _sign(kind: str) -> str:
    if kind in ("before", "floor", "tolerance"):
        return {"before": "○", "floor": "■", "tolerance": "╌"}[kind]
    return "━" if kind.startswith("line") else "●"
