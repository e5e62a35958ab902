"""The letters of reports on paper."""

from __future__ import annotations

from functools import cache
from pathlib import Path

from reportlab.lib.colors import HexColor
from reportlab.lib.styles import ParagraphStyle
from reportlab.pdfbase import pdfmetrics
from reportlab.pdfbase.ttfonts import TTFont

from .line_styles import light

_NAMES = ("DejaVuSans", "DejaVuSans-Bold")


@cache
def fonts() -> tuple[str, str]:
    """Regular and bold, registered once: Greek letters, ± and ≤ are in them, and matplotlib brings them."""
    import matplotlib

    for name in _NAMES:
        pdfmetrics.registerFont(TTFont(name, Path(matplotlib.get_data_path()) / "fonts" / "ttf" / f"{name}.ttf"))
    return _NAMES


def styles_of(font: str, bold: str) -> dict[str, ParagraphStyle]:
    """How each kind of text stands, by name."""
    ink, quiet = HexColor(light()["ink"]), HexColor(light()["quiet"])
    text = ParagraphStyle("text", fontName=font, fontSize=9, leading=13, textColor=ink, spaceAfter=4)
    made = {
        "title": {"fontName": bold, "fontSize": 15, "leading": 19, "spaceAfter": 6},
        "heading": {"fontName": bold, "fontSize": 11, "leading": 14, "spaceBefore": 14, "spaceAfter": 6},
        "figure": {"fontName": bold, "fontSize": 8.5, "leading": 11, "spaceBefore": 4},
        "quiet": {"fontSize": 8, "leading": 11, "textColor": quiet},
        "caption": {"fontSize": 8, "leading": 11, "textColor": quiet, "spaceBefore": 6, "spaceAfter": 2},
        "bullet": {"leftIndent": 10, "firstLineIndent": -10, "spaceAfter": 2},
        "bar": {"spaceAfter": 0, "spaceBefore": 3},
    }
    return {"text": text} | {name: ParagraphStyle(name, parent=text, **changed) for name, changed in made.items()}
