"""What a CSV file's first lines say: delimiter, decimal sign, names, units, statements, where the numbers start."""

from __future__ import annotations

import csv
import re
from dataclasses import dataclass
from pathlib import Path

from .base import RecordingError
from .contents import is_unit, name_and_unit

#: Tried in this order; the earlier wins where two explain the file equally well.
_CANDIDATES = [(";", "."), (";", ","), ("\t", "."), ("\t", ","), ("|", "."), ("|", ","), (",", ".")]
#: A file of one column has no delimiter; this control character stands for it.
NO_DELIMITER = "\x1f"
_ONE_COLUMN = [(NO_DELIMITER, "."), (NO_DELIMITER, ",")]
_SAMPLE_LINES = 400
_COMMENT = re.compile(r"\s*(?:#|%|//)+\s*")
_STATEMENT = re.compile(r"([^=:]+?)\s*[=:]\s*(\S.*?)\s*")


@dataclass(frozen=True)
class Layout:
    """`first` is the number of the first line of numbers; `units` has one entry per name, None where unsaid."""

    delimiter: str
    decimal: str
    first: int
    names: list[str]
    units: list[str | None]
    statements: dict[str, str]


@dataclass(frozen=True)
class _Table:
    """One reading of the sample: fields of every line, and the first line of numbers."""

    delimiter: str
    decimal: str
    first: int
    columns: int
    numeric_lines: int
    rows: list[list[str]]

    @property
    def titles(self) -> list[list[str]]:
        """Lines above the numbers that could be names or units: as many fields as columns, none of them a number."""
        above = [row for row in self.rows[: self.first] if any(row)]
        fitting = [len(row) == self.columns and all(self._is_title(field) for field in row) for row in above]
        last_misfit = max((i for i, fits in enumerate(fitting) if not fits), default=-1)
        return above[last_misfit + 1 :]

    def _is_title(self, field: str) -> bool:
        # `force,acc` above `1,2` and `3` is a damaged table of two columns, not one column with a decimal comma.
        several = self.delimiter == NO_DELIMITER and any(d in field for d, _ in _CANDIDATES)
        return not several and not _is_number(field, self.decimal)


def sniff(path: Path, lines: list[str]) -> Layout:
    """The layout of a file that starts with `lines`. Raises `RecordingError` where none explains it."""
    sample = lines[:_SAMPLE_LINES]
    tables = [t for d, c in _CANDIDATES + _ONE_COLUMN if (t := _read_as(sample, d, c)) is not None]
    if not tables:
        raise RecordingError(f"{path.name}: no line of numbers found; expected columns separated by , ; tab or |")
    best = max(tables, key=lambda t: (bool(t.titles), t.numeric_lines, t.columns))
    if not best.titles:
        raise RecordingError(
            f"{path.name}: {best.columns} columns of numbers and no line of names above them; "
            "expected a header such as time,force"
        )
    names, units = _names_and_units(best.titles)
    statements = _statements(sample[: best.first], best)
    return Layout(best.delimiter, best.decimal, best.first, names, units, statements)


def split(line: str, delimiter: str) -> list[str]:
    """Fields of one line, without comment sign, quotes and surrounding blanks; none of a commented statement."""
    text = _COMMENT.sub("", line, count=1) if _COMMENT.match(line) else line
    if text is not line and _STATEMENT.fullmatch(text):
        return []
    if '"' in text:
        return [field.strip() for field in next(csv.reader([text], delimiter=delimiter))]
    return [field.strip() for field in text.split(delimiter)]


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
    return None if first is None else _Table(delimiter, decimal, first, columns, widths.count(columns), rows)


def _is_numeric_row(row: list[str], decimal: str) -> bool:
    return any(_is_number(f, decimal) for f in row) and all(f == "" or _is_number(f, decimal) for f in row)


def _is_number(field: str, decimal: str) -> bool:
    if decimal == ",":
        if "." in field:
            return False
        field = field.replace(",", ".")
    elif "," in field:
        return False
    try:
        float(field)
    except ValueError:
        return False
    return "_" not in field


def _names_and_units(titles: list[list[str]]) -> tuple[list[str], list[str | None]]:
    """The last line of titles, or the last but one where the last holds units."""
    under = [field.strip("[]() ") for field in titles[-1]]
    if len(titles) > 1 and any(under) and all(field in ("", "-") or is_unit(field) for field in under):
        pairs = [name_and_unit(label) for label in titles[-2]]
        return [name for name, _ in pairs], [u or own for u, (_, own) in zip(under, pairs, strict=True)]
    pairs = [name_and_unit(label) for label in titles[-1]]
    return [name for name, _ in pairs], [unit for _, unit in pairs]


def _statements(above: list[str], table: _Table) -> dict[str, str]:
    """`# fs = 51200`, `fs: 51200` and `fs;51200` in the lines above the numbers."""
    found: dict[str, str] = {}
    for line in above:
        fields = [field for field in split(line, table.delimiter) if field]
        match = _STATEMENT.fullmatch(_COMMENT.sub("", line, count=1).strip())
        if match is not None:
            found[match.group(1).strip()] = match.group(2).strip().rstrip(table.delimiter)
        elif len(fields) == 2 and fields not in table.titles:
            found[fields[0]] = fields[1]
    return found
