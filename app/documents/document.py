"""What a report holds, whatever it is written as: a title, facts, and sections of text, tables,
bars and figures.

`page` makes a web page of it, which `pdf` prints. Words stand here as they are; the templates
escape them.
"""

from __future__ import annotations

import datetime as dt
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import astuple, dataclass

import numpy as np

from ...array_types import Floats
from ..common.number_format import NOTHING, format_number
from ..common.quantities import measured_cell
from ..figures.figure import Plot

#: What a table's cell may hold; numbers are set right and told to four digits, None is a dash.
Cell = str | float | None

#: No control characters and no halves of characters: neither HTML nor XML has a way to write them.
_UNPRINTABLE = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\ud800-\udfff\ufffe\uffff]")
_NUMBER = re.compile(r"[-+−]?\d[\d.e+-]*( ± [\d.e+-]+| to [-+]?\d[\d.e+-]*)?( %)?")


@dataclass(frozen=True)
class Paragraph:
    """Text; `quiet` for a remark."""

    text: str
    quiet: bool = False


@dataclass(frozen=True)
class Bullets:
    """A line for each item; `empty` is said where there is none. `quiet` for remarks."""

    lines: Sequence[str]
    empty: str
    quiet: bool = False


@dataclass(frozen=True)
class Table:
    """Rows under headings; `empty` is said where there is no row. `caption` tells what it is of.

    `main` are the columns that a telephone shows before a person asks for all; () for all of them.
    """

    caption: str
    columns: Sequence[str]
    rows: Sequence[Sequence[Cell]]
    empty: str = "None."
    main: Sequence[str] = ()

    def is_number(self, column: int) -> bool:
        """Whether a column holds numbers, so that its digits stand below each other."""
        cells = [row[column] for row in self.rows if row[column] not in (None, NOTHING)]
        return bool(cells) and all(
            not isinstance(cell, str) or _NUMBER.fullmatch(cell) for cell in cells
        )


@dataclass(frozen=True)
class ShareBar:
    """A bar from `start` to `end`, shares of its track; `kind` is "named", "other" or "floor".
    `lines` stand as a list below it."""

    name: str
    value: str
    start: float
    end: float
    kind: str
    about: str = ""
    lines: Sequence[str] = ()


@dataclass(frozen=True)
class Bars:
    """Bars on tracks of one length."""

    bars: Sequence[ShareBar]


@dataclass(frozen=True)
class ChartRow:
    """Charts beside each other where there is room; `wide` ones take the whole width, each."""

    figures: Sequence[Plot]
    wide: bool = False


@dataclass(frozen=True)
class Photograph:
    """A picture in the size in which it is printed, a JPEG; `facts` are told below its caption, and
    the SHA-256 of the file that it was made of."""

    caption: str
    facts: str
    sha256: str
    jpeg: bytes
    width_px: int
    height_px: int


@dataclass(frozen=True)
class Photographs:
    """Pictures with their captions, two beside each other where there is room."""

    pictures: Sequence[Photograph]


Block = Paragraph | Bullets | Table | Bars | ChartRow | Photographs


@dataclass(frozen=True)
class Section:
    """Blocks under a heading."""

    title: str
    blocks: Sequence[Block]


@dataclass(frozen=True)
class Document:
    """A report on one thing. `kind` says what it is ("Campaign"), `title` which one, `lead` tells
    it in a sentence.

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

    @property
    def words(self) -> str:
        """All of its text, to see which letters it needs."""
        return clean("".join(_texts(astuple(self))))


def _texts(part: object) -> Iterator[str]:
    """The texts within nested tuples, lists and mappings."""
    if isinstance(part, str):
        yield part
    elif isinstance(part, Mapping):
        yield from _texts(list(part.items()))
    elif isinstance(part, Sequence) and not isinstance(part, bytes):
        for member in part:
            yield from _texts(member)


def cell_text(cell: Cell) -> str:
    """A cell in words, numbers to four digits; no line ends between a number and its per cent."""
    if cell is None or (isinstance(cell, float) and not math.isfinite(cell)):
        return NOTHING
    if isinstance(cell, str):
        return clean(cell).replace(" %", "\u00a0%")
    return format_number(cell) if isinstance(cell, float) else f"{cell}"


def clean(text: str) -> str:
    """`text` with a replacement sign for each character that no document can hold."""
    return _UNPRINTABLE.sub("\ufffd", text)


def mean_and_spread(key: str, values: Floats) -> str | None:
    """ "5.62 ± 0.11": mean and standard deviation of `values` (n,) of the quantity `key`, in the
    shown unit; of one value, the value; None without any."""
    finite_values = values[np.isfinite(values)]
    if not finite_values.size:
        return None
    mean = float(finite_values.mean())
    spread = float(finite_values.std(ddof=1)) if finite_values.size > 1 else 0.0
    return measured_cell(key, mean, spread if spread > 1e-9 * abs(mean) else 0.0)
