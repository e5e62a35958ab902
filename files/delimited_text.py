"""Tables in text files: encoding, delimiter, rows below a header, numbers as people write them."""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import zip_longest
from typing import Self

from .number_notation import AmbiguousNumberError, notation_of, plain_number, readings
from .spreadsheet_guard import without_guard

#: A row's number in the file, counted from one, and its cells without the blanks around them.
Row = tuple[int, list[str]]
#: A row's number in the file, and its cells by column.
Line = tuple[int, dict[str, str]]

_UTF16_MARKS = (b"\xff\xfe", b"\xfe\xff")
_UTF8_MARK = b"\xef\xbb\xbf"
#: A letter beyond ASCII as UTF-8 has it; Windows-1252 would spell nonsense with these bytes.
_UTF8_LETTER = re.compile(rb"[\xc2-\xdf][\x80-\xbf]|[\xe0-\xef][\x80-\xbf]{2}")


def decode_utf8(content: bytes) -> str:
    """What a person wrote, with or without a byte order mark.

    No other encoding is tried: a name that is read wrongly would be stored as another name.

    Parameters:
        content: All bytes of the file.

    Raises:
        ValueError: Where a byte is no UTF-8; the message tells the place of the first one.
    """
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ValueError(f"byte {error.start} is not UTF-8; save the file as UTF-8") from error


def decode_instrument_text(content: bytes) -> str:
    """What an instrument wrote: whole UTF-8, UTF-16 or Windows-1252.

    UTF-16 is known by its mark. What is no UTF-8 and has no letter of it is Windows-1252, which
    instruments write for `°` and `µ`.

    Parameters:
        content: All bytes of the file.

    Raises:
        ValueError: For any other encoding, and for a damaged text; the message tells the place of
            the first wrong byte.
    """
    if content.startswith(_UTF16_MARKS):
        try:
            return content.decode("utf-16")
        except UnicodeDecodeError as error:
            raise ValueError(f"its UTF-16 text is cut or damaged at byte {error.start}") from error
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        damage = f"byte {error.start} (0x{content[error.start]:02x}) is not UTF-8"
        if content.startswith(_UTF8_MARK) or _UTF8_LETTER.search(content):
            raise ValueError(
                f"{damage}, and other bytes are; it is damaged: save the file again"
            ) from error
        try:
            return content.decode("cp1252")
        except UnicodeDecodeError:
            raise ValueError(f"{damage}, nor Windows-1252: save the file again as UTF-8") from error


def delimiter_of(text: str) -> str:
    """The semicolon, tab or comma that stands most often in the first line that holds anything; a
    comma without any.

    Parameters:
        text: The text of the table.
    """
    first = next((line for line in text.splitlines() if line.strip()), "")
    return max((sign for sign in ";\t," if sign in first), key=first.count, default=",")


def table_rows(text: str, *, strict: bool = False) -> list[Row]:
    """The rows that hold anything, with `delimiter_of` between their cells.

    A number that can be read in two ways (`1,250`) is written as Python does where the other
    numbers of the table prove its meaning. A text that was guarded against spreadsheets is as it
    was before.

    Parameters:
        text: The text of the table.
        strict: Whether a quote that is not closed is refused, too; by default it is not.

    Raises:
        ValueError: For a number with two readings that no other number settles, and for what is no
            CSV, where the message names the row; for a text that holds a NUL character.
    """
    if "\0" in text:
        raise ValueError(f"holds a NUL character at {text.index(chr(0))}; not a text file")
    delimiter = delimiter_of(text)
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=delimiter, strict=strict)
    try:
        rows = [
            (reader.line_num, [without_guard(cell.strip()) for cell in cells]) for cells in reader
        ]
    except csv.Error as error:
        raise ValueError(f"row {reader.line_num}: {error}") from error
    rows = [(line, cells) for line, cells in rows if any(cells)]
    # a single column has no delimiter
    return _with_settled_numbers(
        rows, comma_cells=delimiter == "," and any(len(cells) > 1 for _, cells in rows)
    )


def _with_settled_numbers(rows: list[Row], *, comma_cells: bool) -> list[Row]:
    """`rows` without numbers that have two readings."""
    doubtful = {text for _, cells in rows for text in cells if len(readings(text)) > 1}
    if not doubtful:
        return rows
    columns = zip_longest(*(cells for _, cells in rows), fillvalue="")
    try:
        notation = notation_of(columns, comma_cells=comma_cells, by_hand=True)
    except AmbiguousNumberError as error:
        line = next(line for line, cells in rows if error.text in cells)
        raise ValueError(f"row {line}: {error}; write {error.choices}") from error
    assert notation is not None  # a doubtful number among contradictory ones is refused
    return [
        (line, [notation.plain(text) if text in doubtful else text for text in cells])
        for line, cells in rows
    ]


@dataclass(frozen=True)
class HeadedTable:
    """Rows by the names of the header. `lines` lacks the rows that `row_problems` names."""

    header: list[str]
    lines: list[Line]
    header_problems: list[str]
    row_problems: list[str]

    @classmethod
    def of(cls, rows: Sequence[Row]) -> Self:
        """The table of rows whose first one is the header.

        Parameters:
            rows: The rows that hold anything, as `table_rows` gives them.

        Raises:
            ValueError: Where there is no row at all.
        """
        if not rows:
            raise ValueError("empty; expected a header and at least one row")
        (_, header), *body = rows
        width = len(header)
        problems = [
            f"column {name!r:.100} stands twice" if name else f"column {number} has no name"
            for number, name in enumerate(header, 1)
            if not name or header.count(name) > 1
        ]
        misfits = [(line, len(cells)) for line, cells in body if len(cells) != width]
        return cls(
            header,
            [
                (line, dict(zip(header, cells, strict=True)))
                for line, cells in body
                if len(cells) == width
            ],
            list(dict.fromkeys(problems)),
            [
                f"row {line}: {count} cells; expected {width} as in the header"
                for line, count in misfits
            ],
        )

    def check(self) -> None:
        """Raise `ValueError` with the first problem; nothing where there is none."""
        for problem in (*self.header_problems, *self.row_problems):
            raise ValueError(problem)


def parse_number(text: str) -> float:
    """A number as a person or a spreadsheet writes it, thousands apart or not.

    Parameters:
        text: The cell.

    Raises:
        ValueError: For anything that is no finite number.
        AmbiguousNumberError: For a comma that has two readings (`1,250`).
    """
    try:
        # Python's own spellings, 1_0 and digits of other scripts, are slips of the keyboard in a
        # table.
        value = float(text if text.isascii() and "_" not in text else plain_number(text))
    except ValueError:
        value = float(plain_number(text))
    if not math.isfinite(value):
        raise ValueError(f"{text!r} is not finite")
    return value
