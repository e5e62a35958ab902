"""The tables that a lab writes by hand: CSV, its delimiter found in the header, or a spreadsheet.

Every row is as long as the header.

Tables from spreadsheets, `.xlsx` and `.xls`: each cell as the text that a CSV file would hold,
without loss.
"""

from __future__ import annotations

import datetime as dt
import io
import zipfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from ...files.delimited_text import HeadedTable, Line, Row, decode_utf8, table_rows
from ..errors import LONGEST_NAME, Faults, IngestError, enumerated, printable

SUFFIXES = (".xlsx", ".xls")
#: Of the sheet that is read where a workbook has several.
SHEET = "runs"
#: A table of 10,000 rows and 20 columns has 1 MB as .xlsx and 7 MB of XML within, for which
#: openpyxl takes 200 MB.
LARGEST_FILE_BYTES, LARGEST_CONTENT_BYTES, MOST_ROWS, MOST_COLUMNS = (
    10 * 10**6,
    20 * 10**6,
    100_000,
    1_000,
)

#: Row and column, counted from one -> value, of the cells that hold something.
_Cells = dict[tuple[int, int], Any]


class SheetError:
    """A cell whose formula gives no value; `text` is what the spreadsheet shows there."""

    def __init__(self, text: str) -> None:
        self.text = text


def sheet_lines(path: Path, name: str) -> list[Row]:
    """Row number and cells, as many as the header's, of each row that holds anything; the first is
    the header.

    Numbers are written with all their digits and without a needless point (0.1, 12), dates as ISO.
    Raises `IngestError` for what is no spreadsheet, for one that unpacks to far more than such a
    table needs, and with row and column for cells that would be lost: merged, to the right of the
    header, or a formula without a value. `FileNotFoundError`.
    """
    content = _content(path, name)
    read = _xlsx if path.suffix.lower() == ".xlsx" else _xls
    try:
        cells = read(content, name)
    except IngestError:
        raise
    except ImportError as error:
        raise IngestError(
            f"{name}: reading it needs the package {error.name}; pip install {error.name}"
        ) from error
    # What the libraries raise on damaged files: BadZipFile, KeyError, XLRDError, struct.error,
    # AssertionError and more.
    except Exception as error:
        reason = " ".join(str(error).split())[:200] or type(error).__name__
        raise IngestError(f"{name}: damaged, or not what its suffix says: {reason}") from error
    return _lines(cells, name)


def _content(path: Path, name: str) -> bytes:
    try:
        size = path.stat().st_size
        if size > LARGEST_FILE_BYTES:
            raise IngestError(
                f"{name}: has {size:,} bytes; expected a table of at most {LARGEST_FILE_BYTES:,}"
            )
        return path.read_bytes()
    except FileNotFoundError:
        raise
    except OSError as error:
        raise IngestError(f"{name}: cannot be read: {error.strerror}") from error


def _lines(cells: _Cells, name: str) -> list[Row]:
    rows: dict[int, dict[int, str]] = {}
    faults = Faults()
    for (row, column), value in sorted(cells.items()):
        if isinstance(value, SheetError):
            faults.add(
                [
                    f"{name}: row {row}, column {_letters(column)}: "
                    f"{printable(value.text)}; expected a value"
                ]
            )
        elif text := cell_text(value).strip():
            rows.setdefault(row, {})[column] = text
    if rows:
        width = max(rows[min(rows)])
        faults.add(
            f"{name}: row {row}, column {_letters(column)}: "
            f"{printable(text)}; the header has no name for this column"
            for row, texts in rows.items()
            for column, text in texts.items()
            if column > width
        )
    faults.refuse()
    return [
        (row, [texts.get(column, "") for column in range(1, width + 1)])
        for row, texts in rows.items()
    ]


def cell_text(value: object) -> str:
    """The text of a cell's value: 12 for 12.0, 0.1 for 0.1, 2026-03-02 for a date."""
    if isinstance(value, bool):
        return str(value).upper()
    if isinstance(value, float):
        return str(int(value)) if value.is_integer() and abs(value) < 1e15 else repr(value)
    if isinstance(value, dt.datetime) and value.time() == dt.time():
        return value.date().isoformat()
    if isinstance(value, dt.datetime | dt.date | dt.time):
        return value.isoformat()
    return str(value)


def _letters(column: int) -> str:
    """A column as a spreadsheet calls it: A, Z, AA."""
    letters = ""
    while column:
        column, rest = divmod(column - 1, 26)
        letters = chr(ord("A") + rest) + letters
    return letters


def _chosen(filled: Mapping[str, object], name: str) -> str | None:
    """The sheet with the table: the only one that holds anything, or the one called "runs"; None of
    an empty book."""
    if len(filled) > 1 and SHEET not in filled:
        sheets = enumerated([repr(sheet) for sheet in filled])
        raise IngestError(
            f"{name}: {len(filled)} sheets hold something: {sheets}; call the "
            f"one with the runs {SHEET!r}"
        )
    return SHEET if SHEET in filled else next(iter(filled), None)


def _refuse_size(name: str, rows: int, columns: int) -> None:
    if rows > MOST_ROWS or columns > MOST_COLUMNS:
        raise IngestError(
            f"{name}: its last cell is in row {rows:,}, column {_letters(columns)}; expected a "
            f"table of at most {MOST_ROWS:,} rows and {MOST_COLUMNS:,} columns"
        )


def _refuse_merged(name: str, ranges: list[str]) -> None:
    if ranges:
        raise IngestError(
            f"{name}: merged cells {enumerated(ranges)}; write the value into "
            f"each cell, for a merged one has it once"
        )


def _xlsx(content: bytes, name: str) -> _Cells:
    import openpyxl

    _refuse_bomb(content, name)
    books = [
        openpyxl.load_workbook(io.BytesIO(content), data_only=values) for values in (True, False)
    ]
    sheet = _chosen({s.title: s for s in books[1].worksheets if any(_filled(s))}, name)
    if sheet is None:
        return {}
    values, formulas = (dict(_filled(book[sheet])) for book in books)
    _refuse_size(name, max(row for row, _ in formulas), max(column for _, column in formulas))
    _refuse_merged(name, [str(cells) for cells in books[0][sheet].merged_cells.ranges])
    errors = {
        place: SheetError(str(cell.value))
        for place, cell in formulas.items()
        if place not in values
    }
    errors |= {
        place: SheetError(str(cell.value))
        for place, cell in values.items()
        if cell.data_type == "e"
    }
    return {place: cell.value for place, cell in values.items()} | errors


def _filled(sheet: Any) -> Iterator[tuple[tuple[int, int], Any]]:
    # Its own iterators make a cell of every place up to the last one, which may be the
    # 17,000,000,000th.
    return ((place, cell) for place, cell in sheet._cells.items() if cell.value is not None)


def _refuse_bomb(content: bytes, name: str) -> None:
    """Read every member once: a size that is declared too small ends in a wrong checksum."""
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        large = sum(member.file_size for member in archive.infolist())
        if large > LARGEST_CONTENT_BYTES:
            raise IngestError(
                f"{name}: unpacks to {large:,} bytes from {len(content):,}; "
                f"expected at most {LARGEST_CONTENT_BYTES:,}"
            )
        if (damaged := archive.testzip()) is not None:
            raise IngestError(
                f"{name}: damaged: {printable(damaged)} in it has another checksum than it says"
            )


def _xls(content: bytes, name: str) -> _Cells:
    import xlrd

    book = xlrd.open_workbook(
        file_contents=content, logfile=io.StringIO(), formatting_info=True, ragged_rows=True
    )
    sheets = {
        sheet.name: cells for sheet in book.sheets() if (cells := dict(_xls_cells(book, sheet)))
    }
    chosen = _chosen(sheets, name)
    if chosen is None:
        return {}
    _refuse_size(
        name, max(row for row, _ in sheets[chosen]), max(column for _, column in sheets[chosen])
    )
    merged = book.sheet_by_name(chosen).merged_cells
    _refuse_merged(
        name,
        [
            f"{_letters(first_column + 1)}{top + 1}:{_letters(right)}{bottom}"
            for top, bottom, first_column, right in merged
        ],
    )
    return sheets[chosen]


def _xls_cells(book: Any, sheet: Any) -> Iterator[tuple[tuple[int, int], Any]]:
    import xlrd

    for row in range(sheet.nrows):
        for column in range(sheet.row_len(row)):
            value, kind = sheet.cell_value(row, column), sheet.cell_type(row, column)
            if kind == xlrd.XL_CELL_DATE:
                value = xlrd.xldate.xldate_as_datetime(value, book.datemode)
            elif kind == xlrd.XL_CELL_BOOLEAN:
                value = bool(value)
            elif kind == xlrd.XL_CELL_ERROR:
                value = SheetError(xlrd.error_text_from_code.get(value, "#ERROR"))
            if kind not in (xlrd.XL_CELL_EMPTY, xlrd.XL_CELL_BLANK):
                yield (row + 1, column + 1), value


def read_table(path: Path, name: str, faults: Faults | None = None) -> tuple[list[str], list[Line]]:
    """The header and, for each row that holds anything, its line number and its cells by column,
    blanks stripped.

    Raises `IngestError` with `name` and row for a file that is neither UTF-8 text nor a spreadsheet
    (`sheets`), for columns without a name of their own, and for rows of another length than the
    header; `FileNotFoundError` where there is none. Where `faults` are given, those of rows are
    kept there, and the other rows are returned.
    """
    try:
        is_sheet = path.suffix.lower() in SUFFIXES
        table = HeadedTable.of(
            sheet_lines(path, name) if is_sheet else table_rows(_text(path, name))
        )
    except IngestError:
        raise
    except ValueError as error:
        raise IngestError(f"{name}: {error}") from error
    of_header, of_rows = Faults(), Faults() if faults is None else faults
    of_header.add(f"{name}: {problem}" for problem in table.header_problems)
    of_header.add(
        f"{name}: column {printable(column)}: expected a name of at most {LONGEST_NAME} characters"
        for column in table.header
        if len(column) > LONGEST_NAME
    )
    of_header.refuse()
    of_rows.add(f"{name}: {problem}" for problem in table.row_problems)
    if faults is None:
        of_rows.refuse()
    return table.header, table.lines


def _text(path: Path, name: str) -> str:
    try:
        return decode_utf8(path.read_bytes())
    except FileNotFoundError:
        raise
    except OSError as error:
        raise IngestError(f"{name}: cannot be read: {error.strerror}") from error
