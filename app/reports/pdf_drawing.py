"""Our own charts on paper: the few SVG elements that `svg` writes, as ReportLab's shapes in the inks of a report."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

from .document import clean
from .line_styles import Ink, inks

if TYPE_CHECKING:
    from reportlab.graphics.shapes import Drawing

_TURNED = re.compile(r"translate\(([-\d.]+) ([-\d.]+)\) rotate\(-90\)")
#: Of all words of a chart, in its units, as the style of the page says.
_FONT_SIZE = 11.0


def drawing_of(svg: str, font: str, width: float) -> Drawing:
    """A chart `width` points wide. Raises `ValueError` for an element or a class that charts do not have."""
    from reportlab.graphics.shapes import Drawing, Group

    root = ElementTree.fromstring(clean(svg))  # noqa: S314  # our own, drawn a moment ago
    _, _, across, up = (float(part) for part in root.attrib["viewBox"].split())
    scale = width / across
    # SVG counts down from the top, paper up from the bottom
    group = Group(transform=(scale, 0, 0, -scale, 0, scale * up))
    for element in root:
        for shape in _shapes(element, font):
            group.add(shape)
    drawing = Drawing(width, scale * up)
    drawing.add(group)
    return drawing


def _shapes(element: ElementTree.Element, font: str) -> list[Any]:
    from reportlab.graphics import shapes

    at = element.attrib
    ink = _ink(at["class"])
    match element.tag:
        case "line":
            return [shapes.Line(*(float(at[key]) for key in ("x1", "y1", "x2", "y2")), **_stroke(ink))]
        case "polyline":
            points = _points(at["points"])
            return [shapes.PolyLine(points, strokeLineJoin=1, **_stroke(ink))] if len(points) >= 4 else []
        case "polygon":
            points = _points(at["points"])
            return [shapes.Polygon(points, strokeColor=None, **_fill(ink))] if len(points) >= 6 else []
        case "circle":
            ends = {key: float(at[key]) for key in ("cx", "cy", "r")}
            return [shapes.Circle(**ends, **_fill(ink), **_stroke(ink))]
        case "text":
            return [_words(element, font, ink)]
    raise ValueError(f"a chart has the element {element.tag!r}, which reports on paper do not know")


def _words(element: ElementTree.Element, font: str, ink: Ink) -> Any:
    from reportlab.graphics import shapes

    at = element.attrib
    turned = _TURNED.fullmatch(at.get("transform", ""))
    x, y = (float(turned[1]), float(turned[2])) if turned else (float(at["x"]), float(at["y"]))
    text = shapes.String(
        0, 0, element.text or "", fontName=font, fontSize=_FONT_SIZE, textAnchor=at["text-anchor"], **_fill(ink)
    )
    # letters stand upright again in axes that count downwards; turned ones read upwards
    return shapes.Group(text, transform=(0, -1, -1, 0, x, y) if turned else (1, 0, 0, -1, x, y))


def _ink(name: str) -> Ink:
    if name not in inks():
        raise ValueError(f"a chart has the class {name!r}, which has no ink on paper; there are: {', '.join(inks())}")
    return inks()[name]


def _points(text: str) -> list[float]:
    return [float(number) for pair in text.split() for number in pair.split(",")]


def _fill(ink: Ink) -> dict[str, Any]:
    from reportlab.lib.colors import HexColor

    if ink.fill is None:
        return {"fillColor": None}
    return {"fillColor": HexColor(ink.fill), "fillOpacity": ink.opacity}


def _stroke(ink: Ink) -> dict[str, Any]:
    from reportlab.lib.colors import HexColor

    if ink.stroke is None:
        return {"strokeColor": None}
    return {"strokeColor": HexColor(ink.stroke), "strokeWidth": ink.width, "strokeDashArray": list(ink.dash) or None}
