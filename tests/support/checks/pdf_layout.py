"""What a reader sees of a PDF: text, the place of each line of words, and ink, as PDFium (of
Chromium) reads it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any


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


def count_pages(pdf: bytes) -> int:
    """How many there are."""
    with _opened(pdf) as document:
        return len(document)


def page_sizes(pdf: bytes) -> list[tuple[float, float]]:
    """Width and height of each page in points."""
    with _opened(pdf) as document:
        return [page.get_size() for page in document]


def metadata_of(pdf: bytes) -> dict[str, str]:
    """Title, subject, date: what a PDF says of itself."""
    with _opened(pdf) as document:
        return dict(document.get_metadata_dict(skip_empty=True))


def words_of(pdf: bytes) -> str:
    """The text, in the order of reading."""
    with _opened(pdf) as document:
        return "\n".join(page.get_textpage().get_text_range() for page in document)


def lines_of(pdf: bytes) -> tuple[tuple[float, float], list[PlacedLine]]:
    """The size of the pages in points, and their lines of words, each as large as its ink."""
    size, lines = (0.0, 0.0), []
    with _opened(pdf) as document:
        for number, page in enumerate(document, 1):
            size, text = page.get_size(), page.get_textpage()
            for rectangle in range(text.count_rects()):
                left, bottom, right, top = text.get_rect(rectangle)
                words = " ".join(text.get_text_bounded(left, bottom, right, top).split())
                lines.append(
                    PlacedLine(number, words, left, size[1] - top, right, size[1] - bottom)
                )
    return size, lines


def picture_of(pdf: bytes, page: int = 0) -> Any:
    """A page as grey levels, (rows, columns), at two pixels a point: what ink is on it."""
    import numpy as np

    with _opened(pdf) as document:
        return np.asarray(document[page].render(scale=2, grayscale=True).to_pil())


@contextmanager
def _opened(pdf: bytes) -> Iterator[Any]:
    import pypdfium2

    with pypdfium2.PdfDocument(pdf) as document:
        yield document
