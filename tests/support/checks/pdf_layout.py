"""What a reader sees of a PDF: the text and the place of each word, as Poppler (`pdftotext`) reads them."""

from __future__ import annotations

import shutil
import subprocess
from dataclasses import dataclass
from xml.etree import ElementTree

import pytest


@dataclass(frozen=True)
class PlacedLine:
    """A line of words on a page (from 1): its corners in points, the origin at the upper left."""

    page: int
    text: str
    left_x: float
    top: float
    right_x: float
    bottom: float

    def overlaps(self, other: PlacedLine) -> bool:
        """Whether both cover a common area, by more than a tenth of a point either way."""
        across = min(self.right_x, other.right_x) - max(self.left_x, other.left_x)
        down = min(self.bottom, other.bottom) - max(self.top, other.top)
        return self.page == other.page and across > 0.1 and down > 0.1


def words_of(pdf: bytes) -> str:
    """The text, in the order of reading."""
    return _poppler(pdf, "-raw")


def lines_of(pdf: bytes) -> tuple[tuple[float, float], list[PlacedLine]]:
    """The size of the pages in points, and their lines of words."""
    tree = ElementTree.fromstring(_poppler(pdf, "-bbox-layout"))  # noqa: S314  # Poppler's own
    size, lines = (0.0, 0.0), []
    for number, page in enumerate(tree.iter(f"{_HTML}page"), 1):
        size = float(page.attrib["width"]), float(page.attrib["height"])
        for line in page.iter(f"{_HTML}line"):
            corners = (float(line.attrib[key]) for key in ("xMin", "yMin", "xMax", "yMax"))
            lines.append(PlacedLine(number, " ".join(word.text or "" for word in line), *corners))
    return size, lines


_HTML = "{http://www.w3.org/1999/xhtml}"


def _poppler(pdf: bytes, option: str) -> str:
    program = shutil.which("pdftotext")
    if program is None:
        pytest.skip("pdftotext is not installed (poppler-utils), and only a reader of PDFs can say what is seen")
    return subprocess.run([program, option, "-", "-"], input=pdf, capture_output=True, check=True).stdout.decode()
