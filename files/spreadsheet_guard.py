"""Text in CSV files that a spreadsheet would take for a formula: written with an apostrophe before
it, read without.

A name such as `=HYPERLINK(...)` of a file of unknown origin would act where a person opens an
export (OWASP, "CSV Injection"). Numbers stay as they are, negative ones too. A text that has the
apostrophe already gets another, so that reading gives back what was written.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any, TextIO

#: What a formula begins with, as a keyboard for Chinese or Japanese writes it, too; and more text
#: behind it.
_FORMULA = re.compile("'*[=+\\-@\t\r\n＝＋－＠].", re.DOTALL)
_NUMBER = re.compile(r"[-+]?(\d+([.,]\d*)?|[.,]\d+)([eE][-+]?\d+)?")
_guarding: ContextVar[bool] = ContextVar("spreadsheet_guard", default=True)


@contextmanager
def guarding(on: bool) -> Iterator[None]:
    """Whether texts are guarded within the block; programs take them as they are.

    Parameters:
        on: True guards them, which is also what happens outside of any block; False writes them as
            they are.
    """
    token = _guarding.set(on)
    try:
        yield
    finally:
        _guarding.reset(token)


def guarded(cell: Any) -> Any:
    """A cell as it is written to CSV.

    Parameters:
        cell: The value of the cell. Only a text that a spreadsheet would take for a formula is
            changed: it gets an apostrophe before it, unless `guarding` is off.
    """
    if (
        not isinstance(cell, str)
        or not _FORMULA.match(cell)
        or _NUMBER.fullmatch(cell)
        or not _guarding.get()
    ):
        return cell
    return f"'{cell}"


def without_guard(cell: str) -> str:
    """A cell as it was before `guarded`.

    Parameters:
        cell: The text of the cell as the file has it.
    """
    return cell[1:] if cell.startswith("'") and _FORMULA.match(cell) else cell


def guarded_frame(frame: Any) -> Any:
    """A pandas frame whose texts and column names are guarded.

    Parameters:
        frame: The DataFrame that will be written; it is not changed itself.
    """
    return frame.map(guarded).rename(columns=guarded)


class GuardedCsv:
    """Rows into an open stream, cell by cell guarded."""

    def __init__(self, stream: TextIO, line_end: str = "\r\n") -> None:
        self._writer = csv.writer(stream, lineterminator=line_end)

    def write_row(self, cells: Iterable[Any]) -> None:
        """Write one row.

        Parameters:
            cells: The values of its cells, in the order of the columns.
        """
        self._writer.writerow([guarded(cell) for cell in cells])

    def write_rows(self, rows: Iterable[Iterable[Any]]) -> None:
        """Write several rows.

        Parameters:
            rows: The cells of each row, in the order of the columns.
        """
        for row in rows:
            self.write_row(row)
