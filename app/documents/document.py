"""What a report holds, whatever it is written as: a title, facts, and sections of text, tables, bars and figures, with
settings and figures in the words and units of the bench.

`page` makes a web page of it and `pdf` a PDF. Words stand here as they are; each writer escapes them in its own way.
"""

from __future__ import annotations

import datetime as dt
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...array_types import Floats
from ...schema.known_factors import BY_COLUMN, KNOWN_FACTORS, NONE
from ...schema.listings import listing_key
from ..common.number_format import format_number

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
    """A line for each item; `empty` is said where there is none. `quiet` for remarks."""

    lines: Sequence[str]
    empty: str
    quiet: bool = False


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
    """A bar from `start` to `end`, shares of its track; `kind` is "named", "other" or "floor". `lines` stand as a list
    below it."""

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

    `date` is its own and not that of printing: the same thing gives the same file. `dense`: smaller on paper.
    """

    kind: str
    title: str
    lead: str
    facts: Mapping[str, str]
    sections: Sequence[Section]
    date: dt.date | None = None
    dense: bool = False

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
    return format_number(cell) if isinstance(cell, float) else f"{cell}"


def clean(text: str) -> str:
    """`text` with a replacement sign for each character that no document can hold."""
    return _UNPRINTABLE.sub("\ufffd", text)


@dataclass(frozen=True)
class FactorLabel:
    """How a factor is told: "tip radius" in "mm", of which one SI unit is `per_si`."""

    name: str
    unit: str
    per_si: float

    @property
    def heading(self) -> str:
        """Of a column."""
        return f"{self.name} ({self.unit})" if self.unit else self.name

    def cell(self, level: Any) -> Cell:
        """A level in the unit of the heading."""
        return round(level * self.per_si, 9) if isinstance(level, float) else None if level is None else str(level)

    def words(self, level: Any) -> str:
        """A level by itself: "30 mm"; a layer that is missing by its name."""
        if level is None or level == NONE:
            return f"no {self.name}"
        text = cell_text(self.cell(level))
        return f"{text} {self.unit}" if self.unit and isinstance(level, float) else text

    def named(self, level: Any) -> str:
        """A level with its factor: "tip radius 30 mm"."""
        words = self.words(level)
        return words if words == f"no {self.name}" else f"{self.name} {words}"


_KNOWN = {
    listing_key(factor.name, factor.si_unit): FactorLabel(
        factor.name.replace("_", " "), factor.column.removeprefix(f"{factor.name}_"), 1 / factor.scale
    )
    if factor.is_number
    else FactorLabel(factor.name.replace("_", " "), "", 1.0)
    for factor in KNOWN_FACTORS
} | {"velocity_m_s": FactorLabel("velocity", "m/s", 1.0)}


def setting(key: str) -> FactorLabel:
    """The factor that a listing has under `key`; a lab's own ones keep their name."""
    return _KNOWN.get(key) or FactorLabel(key.replace("_", " "), "", 1.0)


def column_heading(column: str) -> str:
    """A column of a table of runs: "tip radius (mm)"."""
    factor = BY_COLUMN.get(column)
    return setting(listing_key(factor.name, factor.si_unit) if factor else column).heading


def settings_words(levels: Mapping[str, Any]) -> str:
    """ "steel, 30 mm, no insulator"."""
    return ", ".join(setting(key).words(level) for key, level in levels.items()) or "all alike"


def mean_and_spread(values: Floats, scale: float = 1.0) -> str | None:
    """ "5.62 ± 0.11": mean and standard deviation of `values` (n,), to two digits of the latter; of one, the value."""
    finite_values = scale * values[np.isfinite(values)]
    if not finite_values.size:
        return None
    mean = float(finite_values.mean())
    spread = float(finite_values.std(ddof=1)) if finite_values.size > 1 else 0.0
    if not spread > 1e-9 * abs(mean):
        return cell_text(mean)
    decimals = max(0, 1 - math.floor(math.log10(spread)))
    return f"{mean:.{decimals}f} ± {spread:.{decimals}f}"


def force_unit(largest_n: float) -> tuple[str, float]:
    """The unit that a force is told in, and how many of them a newton is."""
    return ("kN", 1e-3) if largest_n >= 1000 else ("N", 1.0)
