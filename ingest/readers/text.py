"""What a text file's first lines say: delimiter, decimal sign, names, units, statements, where the numbers start.

Text recordings: decoded strictly, and whole to the last line end.
"""

from __future__ import annotations

import csv
import re
from dataclasses import dataclass, field
from pathlib import Path

from ...delimited_text import decode_instrument_text
from .base import AS_IN_FILE, ReadingOptions, RecordingError, collapse_blanks
from .contents import is_clock_name, is_unit, name_and_unit

#: One or more blanks or tabs.
BLANKS = " "
#: Tried in this order; the earlier wins where two explain the file equally well.
_CANDIDATES = [(";", "."), (";", ","), ("\t", "."), ("\t", ","), ("|", "."), ("|", ","), (",", ".")]
_BLANK_CANDIDATES = [(BLANKS, "."), (BLANKS, ",")]
#: A file of one column has no delimiter; this control character stands for it.
NO_DELIMITER = "\x1f"
_ONE_COLUMN = [(NO_DELIMITER, "."), (NO_DELIMITER, ",")]
_SAMPLE_LINES = 400
_COMMENT = re.compile(r"\s*(?:#|%|//)+\s*")
_STATEMENT = re.compile(r"([^=:]+?)\s*[=:]\s*(\S.*?)\s*")
_SEPARATOR_AT_BLANK = re.compile(r"[,;](?=\s|$)")
_WORD_AND_UNIT = re.compile(r"\S+(?:\s+(?:\[[^\[\]]*\]|\([^()]*\)))?")


@dataclass(frozen=True)
class Layout:
    """`first` is the number of the first line of numbers; `units` has one entry per name, None where unsaid.

    A column without a name cannot be asked for: row numbers, or a delimiter at the end of every line.
    """

    delimiter: str
    decimal: str
    first: int
    names: list[str]
    units: list[str | None]
    statements: dict[str, str]
    above: list[list[str]] = field(default_factory=list)  # fields of the lines above the numbers
    settings_beside: bool = False  # the columns without a name hold text


@dataclass(frozen=True)
class _Table:
    """One reading of the sample: fields of every line, and the first line of numbers."""

    delimiter: str
    decimal: str
    first: int
    columns: int
    numeric_lines: int
    empty_at_end: int  # columns that a delimiter at the end of every line makes
    lines: list[str]
    rows: list[list[str]]

    @property
    def titles(self) -> list[list[str]]:
        """Lines above the numbers that could be names or units: as many fields as columns, none of them a number."""
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
            text = _SEPARATOR_AT_BLANK.sub(" ", _COMMENT.sub("", self.lines[line], count=1)).strip()
            ways = [_WORD_AND_UNIT.findall(text), *ways, re.split(r"\s*\t\s*|\s{2,}", text)]
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
        # `force,acc` above `1,2` and `3` is a damaged table of two columns, not one column with a decimal comma.
        several = self.delimiter == NO_DELIMITER and any(d in text for d, _ in _CANDIDATES)
        return not several and not _is_number(text, self.decimal)


def sniff(path: Path, lines: list[str], options: ReadingOptions = AS_IN_FILE) -> Layout:
    """The layout of a file that starts with `lines`. Raises `RecordingError` where none explains it.

    A file without a line of names has those of `options`, or `column_1`, `column_2` where its rate is given there.
    """
    sample = lines[:_SAMPLE_LINES]
    candidates = [
        (d, c)
        for d, c in _CANDIDATES + _BLANK_CANDIDATES + _ONE_COLUMN
        if options.delimiter in (None, d) and options.decimal in (None, c)
    ]
    tables = [t for d, c in candidates if (t := _read_as(sample, d, c)) is not None]
    if not tables:
        raise RecordingError(
            f"{path.name}: no line of numbers found; expected columns separated by , ; | tab or blanks"
            + (" (and as delimiter and decimal are given)" if options.delimiter or options.decimal else "")
        )
    best = max(tables, key=lambda t: (bool(t.titles) or t.fits(options.columns), t.numeric_lines, t.columns))
    names, units = _names_and_units(best.titles) if best.titles else ([], [])
    if not names or (best.fits(options.columns) and not _heads_columns(names, options.columns)):
        names, units = _given_names(path, best, tables, options)
    statements = _statements(sample[: best.first], best)
    return Layout(best.delimiter, best.decimal, best.first, names, units, statements, best.rows[: best.first])


def split(line: str, delimiter: str) -> list[str]:
    """Fields of one line, without comment sign, quotes and surrounding blanks; none of a commented statement."""
    text = _COMMENT.sub("", line, count=1) if _COMMENT.match(line) else line
    if text is not line and _STATEMENT.fullmatch(text):
        return []
    if '"' in text:
        text = " ".join(text.split()) if delimiter == BLANKS else text
        return [cell.strip() for cell in next(csv.reader([text], delimiter=delimiter))]
    return text.split() if delimiter == BLANKS else [cell.strip() for cell in text.split(delimiter)]


def _read_as(sample: list[str], delimiter: str, decimal: str) -> _Table | None:
    """The sample under one delimiter and decimal sign; None where that gives no table of numbers."""
    rows = [split(line, delimiter) for line in sample]
    widths = [
        len(row) if not _COMMENT.match(line) and _is_numeric_row(row, decimal) else 0
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
    full = [row for row, width in zip(rows[first:], widths[first:], strict=True) if width == columns]
    empty_at_end = next((n for n in range(columns) if any(row[columns - 1 - n] for row in full)), 0)
    return _Table(delimiter, decimal, first, columns, widths.count(columns), empty_at_end, sample, rows)


def _is_numeric_row(row: list[str], decimal: str) -> bool:
    return any(_is_number(f, decimal) for f in row) and all(f == "" or _is_number(f, decimal) for f in row)


def _is_number(text: str, decimal: str) -> bool:
    if decimal == ",":
        if "." in text or text.endswith(","):
            return False
        text = text.replace(",", ".")
    elif "," in text:
        return False
    try:
        float(text)
    except ValueError:
        return False
    return "_" not in text


def _names_and_units(titles: list[list[str]]) -> tuple[list[str], list[str | None]]:
    """The last line of titles, or the last but one where the last holds units."""
    under = [label.strip("[]() ") for label in titles[-1]]
    if len(titles) > 1 and any(under) and all(label in ("", "-") or is_unit(label) for label in under):
        pairs = [name_and_unit(label) for label in titles[-2]]
        return [name for name, _ in pairs], [u or own for u, (_, own) in zip(under, pairs, strict=True)]
    pairs = [name_and_unit(label) for label in titles[-1]]
    return [name for name, _ in pairs], [unit for _, unit in pairs]


def _heads_columns(names: list[str], given: tuple[str, ...]) -> bool:
    """Whether a line is a heading and no free text of as many words: it names a time, or one of the `given` columns."""
    labels = {collapse_blanks(name_and_unit(label)[0]) for label in given}
    return any(name and (collapse_blanks(name) in labels or is_clock_name(name)) for name in names)


def _given_names(
    path: Path, table: _Table, tables: list[_Table], options: ReadingOptions
) -> tuple[list[str], list[str | None]]:
    """Names of a table without a line of names: as given, else by number where at least the rate is given."""
    width = table.columns - table.empty_at_end
    if options.columns and not table.fits(options.columns):
        raise RecordingError(
            f"{path.name}: has {width} columns of numbers and no line of names, and {len(options.columns)} columns are "
            f"named ({', '.join(options.columns)}); expected as many"
        )
    if not options.columns and options.sampling_rate_hz is None:
        raise RecordingError(
            f"{path.name}: {width} columns of numbers and no line of names above them; expected a header such as "
            'time,force, or columns = ["time", "force"] under [recordings] in campaign.toml'
        )
    other = next((t for t in tables if t.numeric_lines == table.numeric_lines and t.columns != table.columns), None)
    if not options.columns and other is not None:
        raise RecordingError(
            f"{path.name}: can be read as {table.columns} columns or as {other.columns}; give columns, or decimal, "
            "under [recordings] in campaign.toml"
        )
    labels = [*(options.columns or [f"column_{number + 1}" for number in range(width)])]
    pairs = [name_and_unit(label) for label in labels + [""] * (table.columns - len(labels))]
    return [name for name, _ in pairs], [unit for _, unit in pairs]


def _statements(above: list[str], table: _Table) -> dict[str, str]:
    """`# fs = 51200`, `fs: 51200` and `fs;51200` in the lines above the numbers."""
    header: dict[str, str] = {}
    for line in above:
        fields = [field for field in split(line, table.delimiter) if field]
        match = _STATEMENT.fullmatch(_COMMENT.sub("", line, count=1).strip())
        if match is not None:
            header[match.group(1).strip()] = match.group(2).strip().rstrip(table.delimiter)
        elif len(fields) == 2 and fields not in table.titles:
            header[fields[0]] = fields[1]
    return header


def read_text(path: Path, *, may_lack_last_end: bool = False) -> str:
    """The file's text, line ends as `\\n`. Raises `RecordingError` unless it is whole UTF-8, UTF-16 or Windows-1252.

    A last line without line end may be cut inside its last number, which nothing in the file would show; it is refused
    unless `may_lack_last_end`.
    """
    try:
        text = decode_instrument_text(path.read_bytes())
    except ValueError as error:
        raise RecordingError(f"{path.name}: {error}") from error
    if "\0" in text:
        raise RecordingError(f"{path.name}: has a zero byte at {text.index(chr(0))}; expected text")
    text = text.replace("\r\n", "\n").replace("\r", "\n")
    if not text.endswith("\n") and not may_lack_last_end:
        raise RecordingError(
            f"{path.name}: its last line has no line end, so its last number may be cut; "
            "add a line end if the file is whole"
        )
    return text
