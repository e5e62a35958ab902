"""A report as a PDF for print: A4, its own fonts in it, and the same bytes for the same report.
Charts are drawn from the few SVG elements that `svg` writes."""

from __future__ import annotations

import re
from collections.abc import Sequence
from io import BytesIO
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree
from xml.sax.saxutils import escape

from .document import Bars, Block, Bullets, ChartRow, Document, Figure, Paragraph, Table, clean
from .line_styles import SeriesStyle, light, series_styles

if TYPE_CHECKING:
    from reportlab.graphics.shapes import Drawing

    from .pdf_sheet import PdfDocument


class MissingPdfError(ValueError):
    """The library that writes PDFs is not installed."""


def pdf_of(document: Document) -> bytes:
    """The PDF. Raises `MissingPdfError` where ReportLab or the fonts are not installed."""
    try:
        from .pdf_fonts import document_fonts
        from .pdf_sheet import PdfDocument
    except ModuleNotFoundError as error:
        package = (error.name or "").partition(".")[0]
        if package not in ("reportlab", "manimgx_fonts_cjk"):
            raise
        raise MissingPdfError(
            f"{package} is not installed; reports as PDF need it: pip install "
            f"'pyroshock[web]' (or --out FILE.html)"
        ) from error
    into = BytesIO()
    with document_fonts(document.words):
        sheet = PdfDocument(document, into)
        sheet.write(_story(document, sheet))
    return into.getvalue()


def _story(document: Document, sheet: PdfDocument) -> list[Any]:
    from .pdf_fonts import remarks_on_letters

    story = [
        sheet.text(_safe(document.kind.upper()), "quiet"),
        sheet.text(_safe(document.title), "title"),
    ]
    if document.lead:
        story.append(sheet.text(_safe(document.lead)))
    facts = "; ".join(
        f'<font color="{light()["quiet"]}">{_safe(name)}</font>&nbsp; {_safe(value)}'
        for name, value in document.facts.items()
    )
    story.append(sheet.text(facts))
    for section in document.sections:
        blocks = section.blocks or (Paragraph("None.", quiet=True),)
        story += [sheet.room(_start(blocks, sheet)), sheet.text(_safe(section.title), "heading")]
        for block in blocks:
            story += _flowables(block, sheet)
    return story + [
        sheet.text(_safe(remark), "quiet") for remark in remarks_on_letters(document.words)
    ]


def _start(blocks: Sequence[Block], sheet: PdfDocument) -> float:
    """Points that a heading needs: up to the first rows or charts, from which no page break should
    part it."""
    height = sheet.lines_height
    for block in blocks:
        if not isinstance(block, Paragraph):
            return height + (
                sheet.figure_height(block)
                if isinstance(block, ChartRow)
                else 2 * sheet.lines_height
            )
        height += sheet.lines_height
    return height


def _safe(text: str) -> str:
    return escape(clean(text))


def _flowables(block: Block, sheet: PdfDocument) -> list[Any]:
    match block:
        case Paragraph():
            return [sheet.text(_safe(block.text), "quiet" if block.quiet else "text")]
        case Bullets():
            style = "remark" if block.quiet else "bullet"
            lines = [sheet.text(f"•&nbsp; {_safe(line)}", style) for line in block.lines]
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
    return [
        sheet.room(2 * sheet.lines_height),
        sheet.text(_safe(table.caption), "caption"),
        sheet.table(table),
    ]


def _figure(figure: Figure, sheet: PdfDocument, count: int) -> list[Any]:
    drawing = drawing_of(figure.drawing, sheet.font, sheet.figure_width(count))
    keys = [sheet.text(_keys(figure.keys), "quiet")] if figure.keys else []
    return [sheet.text(_safe(figure.title), "figure"), drawing, *keys]


def _keys(keys: Sequence[tuple[str, str]]) -> str:
    """The marks of a legend in their colours."""
    return " &nbsp;&nbsp; ".join(
        f'<font color="{_colour(kind)}">{_sign(kind)}</font>&nbsp;{_unbroken(words)}'
        for kind, words in keys
    )


def _unbroken(words: str) -> str:
    """Some words that no line ends within; many."""
    return _safe(words.replace(" ", "\u00a0") if len(words) <= 40 else words)


def _colour(kind: str) -> str:
    name = "measured-line" if kind == "measured" else kind
    return series_styles()[name].stroke or series_styles()[name].fill or light()["ink"]


def _sign(kind: str) -> str:
    if kind in ("before", "floor", "tolerance", "interval"):
        return {"before": "○", "floor": "■", "tolerance": "╌", "interval": "┃"}[kind]
    return "━" if kind.startswith("line") else "●"


_TURNED = re.compile(r"translate\(([-\d.]+) ([-\d.]+)\) rotate\(-90\)")
#: Of all words of a chart, in its units, as the style of the page says; in a small chart more, up
#: to `_LEAST_POINTS`.
_FONT_SIZE = 11.0
_LEAST_POINTS = 6.0


def drawing_of(svg: str, font: str, width: float) -> Drawing:
    """A chart `width` points wide. Raises `ValueError` for an element or a class that charts do not
    have."""
    from reportlab.graphics.shapes import Drawing, Group

    root = ElementTree.fromstring(clean(svg))  # noqa: S314  # our own, drawn a moment ago
    _, _, across, up = (float(part) for part in root.attrib["viewBox"].split())
    scale = width / across
    # SVG counts down from the top, paper up from the bottom
    group = Group(transform=(scale, 0, 0, -scale, 0, scale * up))
    for element in root:
        for shape in _shapes(element, font, max(_FONT_SIZE, _LEAST_POINTS / scale)):
            group.add(shape)
    drawing = Drawing(width, scale * up)
    drawing.add(group)
    return drawing


def _shapes(element: ElementTree.Element, font: str, size: float) -> list[Any]:
    from reportlab.graphics import shapes

    at = element.attrib
    ink = _ink(at["class"])
    match element.tag:
        case "line":
            return [
                shapes.Line(*(float(at[key]) for key in ("x1", "y1", "x2", "y2")), **_stroke(ink))
            ]
        case "polyline":
            points = _points(at["points"])
            return (
                [shapes.PolyLine(points, strokeLineJoin=1, **_stroke(ink))]
                if len(points) >= 4
                else []
            )
        case "polygon":
            points = _points(at["points"])
            return (
                [shapes.Polygon(points, strokeColor=None, **_fill(ink))] if len(points) >= 6 else []
            )
        case "circle":
            ends = {key: float(at[key]) for key in ("cx", "cy", "r")}
            return [shapes.Circle(**ends, **_fill(ink), **_stroke(ink))]
        case "text":
            return [_words(element, font, size, ink)]
    raise ValueError(f"a chart has the element {element.tag!r}, which reports on paper do not know")


def _words(element: ElementTree.Element, font: str, size: float, ink: SeriesStyle) -> Any:
    from reportlab.graphics import shapes

    at = element.attrib
    turned = _TURNED.fullmatch(at.get("transform", ""))
    x, y = (float(turned[1]), float(turned[2])) if turned else (float(at["x"]), float(at["y"]))
    from .pdf_fonts import font_runs, width_of

    if turned:  # a title is no longer than its axis, at whose middle it stands
        size *= min(1.0, 2 * y / width_of(element.text or " ", font, size))
    runs = font_runs(element.text or "", font)
    widths = [width_of(piece, name, size) for name, piece in runs]
    start = -sum(widths) * {"start": 0.0, "middle": 0.5, "end": 1.0}[at["text-anchor"]]
    text = shapes.Group()
    for (name, piece), width in zip(runs, widths, strict=True):
        text.add(shapes.String(start, 0, piece, fontName=name, fontSize=size, **_fill(ink)))
        start += width
    # letters stand upright again in axes that count downwards; turned ones read upwards
    return shapes.Group(text, transform=(0, -1, -1, 0, x, y) if turned else (1, 0, 0, -1, x, y))


def _ink(name: str) -> SeriesStyle:
    if name not in series_styles():
        raise ValueError(
            f"a chart has the class {name!r}, which has no ink on paper; "
            f"there are: {', '.join(series_styles())}"
        )
    return series_styles()[name]


def _points(text: str) -> list[float]:
    return [float(number) for pair in text.split() for number in pair.split(",")]


def _fill(ink: SeriesStyle) -> dict[str, Any]:
    from reportlab.lib.colors import HexColor

    if ink.fill is None:
        return {"fillColor": None}
    return {"fillColor": HexColor(ink.fill), "fillOpacity": ink.opacity}


def _stroke(ink: SeriesStyle) -> dict[str, Any]:
    from reportlab.lib.colors import HexColor

    if ink.stroke is None:
        return {"strokeColor": None}
    return {
        "strokeColor": HexColor(ink.stroke),
        "strokeWidth": ink.width,
        "strokeDashArray": list(ink.dash) or None,
    }
