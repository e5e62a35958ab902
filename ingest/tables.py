"""The tables that a lab writes by hand: CSV, its delimiter found in the header, or a spreadsheet.

Every row is as long as the header.
"""

from __future__ import annotations

import csv
import io
from pathlib import Path

from .errors import Faults, IngestError
from .printable import LONGEST_NAME, shown
from .sheets import SUFFIXES, sheet_lines

Line = tuple[int, dict[str, str]]


def read_table(path: Path, name: str, faults: Faults | None = None) -> tuple[list[str], list[Line]]:
    """The header and, for each row that holds anything, its line number and its cells by column, blanks stripped.

    Raises `IngestError` with `name` and row for a file that is neither UTF-8 text nor a spreadsheet (`sheets`), for
    columns without a name of their own, and for rows of another length than the header; `FileNotFoundError` where there
    is none. Where `faults` are given, those of rows are kept there, and the other rows are returned.
    """
    lines = sheet_lines(path, name) if path.suffix.lower() in SUFFIXES else _csv_lines(path, name)
    if not lines:
        raise IngestError(f"{name}: empty; expected a header and at least one row")
    header = lines[0][1]
    _check_names(header, name)
    bad = [(line, len(cells)) for line, cells in lines[1:] if len(cells) != len(header)]
    of_rows = Faults() if faults is None else faults
    of_rows.add(f"{name}: row {line}: {count} cells; expected {len(header)} as in the header" for line, count in bad)
    if faults is None:
        of_rows.refuse()
    return header, [
        (line, dict(zip(header, cells, strict=True))) for line, cells in lines[1:] if len(cells) == len(header)
    ]


def _csv_lines(path: Path, name: str) -> list[tuple[int, list[str]]]:
    text = _read_text(path, name)
    first = text.lstrip().split("\n", 1)[0]
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=max(",;\t", key=first.count))
    try:
        return [(reader.line_num, [c.strip() for c in cells]) for cells in reader if any(c.strip() for c in cells)]
    except csv.Error as error:
        raise IngestError(f"{name}: row {reader.line_num}: {error}") from error


def _read_text(path: Path, name: str) -> str:
    try:
        text = path.read_bytes().decode("utf-8-sig")
    except FileNotFoundError:
        raise
    except UnicodeDecodeError as error:
        raise IngestError(f"{name}: byte {error.start} is not UTF-8; save the file as UTF-8") from error
    except OSError as error:
        raise IngestError(f"{name}: cannot be read: {error.strerror}") from error
    if "\x00" in text:
        raise IngestError(f"{name}: holds a NUL character at {text.index(chr(0))}; not a text file")
    return text


def _check_names(header: list[str], name: str) -> None:
    faults = Faults()
    for number, column in enumerate(header, 1):
        if not column:
            faults.add([f"{name}: column {number} has no name"])
        elif header.count(column) > 1:
            faults.add([f"{name}: column {shown(column)} stands twice"])
        if len(column) > LONGEST_NAME:
            faults.add([f"{name}: column {shown(column)}: expected a name of at most {LONGEST_NAME} characters"])
    faults.refuse()
