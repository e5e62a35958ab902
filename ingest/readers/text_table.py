"""A text's first lines as a table under one delimiter: its fields, where the numbers start, and the
lines above that could be names or units."""

from __future__ import annotations

import csv
import re
from dataclasses import dataclass, field

from ...files.number_notation import GROUP_SIGNS, readings
from .clock_times import is_clock_text
from .field_rules import FieldRule

#: One or more blanks or tabs.
BLANKS = " "
#: A file of one column has no delimiter; this control character stands for it.
NO_DELIMITER = "\x1f"
#: Tried in this order; the earlier wins where two explain the file equally well.
DELIMITERS = (";", "\t", "|", ",", BLANKS, NO_DELIMITER)
COMMENT = re.compile(r"\s*(?:#|%|//)+\s*")
STATEMENT = re.compile(r"([^=:]+?)\s*[=:]\s*(\S.*?)\s*")
_SEPARATOR_AT_BLANK = re.compile(r"[,;](?=\s|$)")
_WORD_AND_UNIT = re.compile(r"\S+(?:\s+(?:\[[^\[\]]*\]|\([^()]*\)))?")


@dataclass(frozen=True)
class Layout:
    """`first` is the number of the first line of numbers; `units` has one entry per name, None
    where unsaid.

    A column without a name cannot be asked for: row numbers, or a delimiter at the end of every
    line. `decimal` is the laboratory's word; None leaves it to the numbers. `clocks` are the
    columns of dates and times of day. What an instrument's header adds: the fields of `step` (in
    `time_unit`) and `rate`, the time `start_s` of sample 0 where no column says it, whether the
    first column counts samples, the number of `samples` and its field `length`, and the `rules` of
    its fields.
    """

    delimiter: str
    decimal: str | None
    first: int
    names: list[str]
    units: list[str | None]
    statements: dict[str, str | list[str]]
    above: list[list[str]] = field(default_factory=list)  # fields of the lines above the numbers
    settings_beside: bool = False  # the columns without a name hold text
    clocks: tuple[int, ...] = ()
    counts_samples: bool = False
    step: str = ""
    rate: str = ""
    time_unit: str | None = None
    start_s: float = 0.0
    length: str = ""
    samples: float | None = None
    rules: tuple[FieldRule, ...] = ()


@dataclass(frozen=True)
class TextTable:
    """One reading of the sample: fields of every line, and the first line of numbers."""

    delimiter: str
    decimal: str | None  # as the laboratory states it
    first: int
    columns: int
    numeric_lines: int
    empty_at_end: int  # columns that a delimiter at the end of every line makes
    lines: list[str]
    rows: list[list[str]]
    clocks: tuple[int, ...]

    @property
    def titles(self) -> list[list[str]]:
        """Lines above the numbers that could be names or units: as many fields as columns, none of
        them a number."""
        above = [i for i in range(self.first) if any(self.rows[i])]
        fitting = [self._title(i) for i in above]
        last_misfit = max((i for i, fields in enumerate(fitting) if fields is None), default=-1)
        return [fields for fields in fitting[last_misfit + 1 :] if fields is not None]

    def fits(self, names: tuple[str, ...]) -> bool:
        """Whether there are as many columns as `names`, beside empty ones at the end."""
        return bool(names) and self.columns - self.empty_at_end <= len(names) <= self.columns

    def _title(self, line: int) -> list[str] | None:
        ways = [self.rows[line]]
        if self.delimiter == BLANKS:
            # a heading may have commas between its names above numbers that have blanks
            text = _SEPARATOR_AT_BLANK.sub(" ", COMMENT.sub("", self.lines[line], count=1)).strip()
            ways = [_WORD_AND_UNIT.findall(text), *ways, re.split(r"\s*\t\s*|\s{2,}", text)]
            # `force [N]` is one name above `1 000`, and not the names of two columns
            ways = [cells for cells in ways if len({cell[:1] in ("[", "(") for cell in cells}) < 2]
        for fields in ways:
            padded = self._as_wide(fields)
            if padded is not None and all(self._is_title(cell) for cell in padded):
                return padded
        return None

    def _as_wide(self, fields: list[str]) -> list[str] | None:
        """A line with a delimiter at its end above numbers without, or the other way round."""
        if len(fields) > self.columns and not any(fields[self.columns :]):
            return fields[: self.columns]
        if self.columns - self.empty_at_end <= len(fields) <= self.columns:
            return fields + [""] * (self.columns - len(fields))
        return None

    def _is_title(self, text: str) -> bool:
        # `force,acc` above `1,2` and `3` is a damaged table of two columns, not one column with a
        # decimal comma.
        several = self.delimiter == NO_DELIMITER and any(sign in text for sign in ";\t|,")
        return not several and not is_number(text, self.decimal)


def split(line: str, delimiter: str) -> list[str]:
    """Fields of one line, without comment sign, quotes and surrounding blanks; none of a commented
    statement."""
    text = COMMENT.sub("", line, count=1) if COMMENT.match(line) else line
    if text is not line and STATEMENT.fullmatch(text):
        return []
    if '"' in text:
        text = " ".join(text.split()) if delimiter == BLANKS else text
        return [cell.strip() for cell in next(csv.reader([text], delimiter=delimiter))]
    return text.split() if delimiter == BLANKS else [cell.strip() for cell in text.split(delimiter)]


def read_as(sample: list[str], delimiter: str, decimal: str | None) -> TextTable | None:
    """The sample under one delimiter; None where that gives no table of numbers, with `decimal` if
    it is stated."""
    rows = [split(line, delimiter) for line in sample]
    widths = [
        len(row) if not COMMENT.match(line) and _is_numeric_row(row, decimal) else 0
        for line, row in zip(sample, rows, strict=True)
    ]
    columns = max((w for w in widths if w), key=widths.count, default=0)
    if columns == 0 or (columns == 1) != (delimiter == NO_DELIMITER):
        return None
    # A line of numbers above the names (`51200;8192`) is followed by something else than numbers.
    starts = (i for i, w in enumerate(widths) if w == columns and all(widths[i + 1 : i + 2]))
    first = next(starts, None)
    if first is None:
        return None
    full = [
        row for row, width in zip(rows[first:], widths[first:], strict=True) if width == columns
    ]
    empty_at_end = next((n for n in range(columns) if any(row[columns - 1 - n] for row in full)), 0)
    clocks = tuple(i for i in range(columns) if is_clock_text(full[0][i]))
    if len(clocks) == columns - empty_at_end:
        return None
    return TextTable(
        delimiter,
        decimal,
        first,
        columns,
        widths.count(columns),
        empty_at_end,
        sample,
        rows,
        clocks,
    )


def _is_numeric_row(row: list[str], decimal: str | None) -> bool:
    return any(is_number(f, decimal) for f in row) and all(
        f == "" or is_number(f, decimal) or is_clock_text(f) for f in row
    )


#: What a number with thousands apart looks like; `readings` says which sign is which.
_APART = re.compile(rf"[-+]?[1-9]\d{{0,2}}(?:[.,{GROUP_SIGNS}]\d{{3}})+(?:[.,]\d*)?", re.ASCII)


def is_number(text: str, decimal: str | None = None) -> bool:
    """Whether `text` is a number, thousands apart or not; with this decimal sign or a whole one,
    where it is given."""
    plain = text.replace(",", ".") if "." not in text and not text.endswith(",") else text
    try:
        float(plain)
    except ValueError:
        if _APART.fullmatch(text) is None:
            return False
    if decimal is None or ("." not in text and "," not in text):
        return "_" not in text
    return any(reading.decimal in (None, decimal) for reading in readings(text))
