"""What a report holds, whatever it is written as: a title, facts, and sections of text, tables, bars and figures.

`page` makes a web page of it and `pdf` a PDF. Words stand here as they are; each writer escapes them in its own way.
"""

from __future__ import annotations

import datetime as dt
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

#: What a table's cell may hold; numbers are set right and told to four digits, None is a dash.
Cell = str | float | None

#: No control characters and no halves of characters: neither HTML nor XML has a way to write them.
_UNPRINTABLE = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\ud800-\udfff\ufffe\uffff]")
NOTHING = "–"
_NUMBER = re.compile(r"[-+]?\d[\d.e+-]*( ± [\d.e+-]+| to [-+]?\d[\d.e+-]*)?")


@dataclass(frozen=True)
class Paragraph:
    """Text; `quiet` for a remark."""

    text: str
    quiet: bool = False


@dataclass(frozen=True)
class Bullets:
    """A line for each item; `empty` is said where there is none."""

    lines: Sequence[str]
    empty: str


@dataclass(frozen=True)
class Table:
    """Rows under headings; `empty` is said where there is no row. `caption` tells what it is of."""

    caption: str
    columns: Sequence[str]
    rows: Sequence[Sequence[Cell]]
    empty: str = "None."

    def is_number(self, column: int) -> bool:
        """Whether a column holds numbers, so that its digits stand below each other."""
        cells = [row[column] for row in self.rows if row[column] is not None]
        return bool(cells) and all(not isinstance(cell, str) or _NUMBER.fullmatch(cell) for cell in cells)


@dataclass(frozen=True)
class ShareBar:
    """A bar from `start` to `end`, shares of its track; `kind` is "named", "other" or "floor"."""

    name: str
    value: str
    start: float
    end: float
    kind: str
    about: str = ""


@dataclass(frozen=True)
class Bars:
    """Bars on tracks of one length."""

    bars: Sequence[ShareBar]


@dataclass(frozen=True)
class Figure:
    """A chart of `svg`; `keys` are the marks of its legend, by class, with their meaning."""

    title: str
    drawing: str
    keys: Sequence[tuple[str, str]] = ()


@dataclass(frozen=True)
class ChartRow:
    """Charts beside each other where there is room; `keys` are those of all of them."""

    figures: Sequence[Figure]
    keys: Sequence[tuple[str, str]] = ()


Block = Paragraph | Bullets | Table | Bars | ChartRow


@dataclass(frozen=True)
class Section:
    """Blocks under a heading."""

    title: str
    blocks: Sequence[Block]


@dataclass(frozen=True)
class Document:
    """A report on one thing. `kind` says what it is ("Campaign"), `title` which one, `lead` tells it in a sentence.

    `date` is its own and not that of printing: the same thing gives the same file.
    """

    kind: str
    title: str
    lead: str
    facts: Mapping[str, str]
    sections: Sequence[Section]
    date: dt.date | None = None

    @property
    def name(self) -> str:
        """ "Campaign: spring"."""
        return f"{self.kind}: {self.title}"


def cell_text(cell: Cell) -> str:
    """A cell in words."""
    if cell is None or (isinstance(cell, float) and not math.isfinite(cell)):
        return NOTHING
    if isinstance(cell, str):
        return clean(cell)
    text = f"{cell:.4g}" if isinstance(cell, float) else f"{cell}"
    return f"{float(text):.0f}" if "e+" in text and abs(cell) < 1e7 else text


def clean(text: str) -> str:
    """`text` with a replacement sign for each character that no document can hold."""
    return _UNPRINTABLE.sub("\ufffd", text)
