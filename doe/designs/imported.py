"""A design that somebody else has made: a table with a run number and one column per factor."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from ...files.delimited_text import decode_utf8, table_rows
from ..space import Space
from .base import Design

RUN = "run"
_BIGGEST_RUN = 10**9


@dataclass(frozen=True)
class ImportedDesign(Design):
    """A design with the table's own run numbers, one per treatment."""

    runs: tuple[int, ...]


def read_table(path: Path, space: Space) -> ImportedDesign:
    """The treatments of a table, in its order; equal ones are kept.

    Parameters:
        path: A CSV file in UTF-8, with commas, semicolons or tabs between the cells, and the
            columns "run" and those of the space in any order.
        space: What the campaign varies, whose levels the cells name.

    Raises:
        ValueError: For another content; the message names file, row, column, value and what was
            expected.
        FileNotFoundError: Where there is no such file.
    """
    try:
        rows = table_rows(decode_utf8(path.read_bytes()), strict=True)
        if not rows:
            raise ValueError("empty; expected a header and at least one run")
        header, *lines = rows
        _check_header(header[1], space)
        cells_by_column = [_row(header[1], cells, line) for line, cells in lines]
        if not cells_by_column:
            raise ValueError("no runs below the header; expected at least one")
        runs = _run_numbers(cells_by_column, [line for line, _ in lines])
        return ImportedDesign(space, space.treatments(cells_by_column), "import", None, runs)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error


def _check_header(header: Sequence[str], space: Space) -> None:
    expected = (RUN, *space.columns)
    for column, count in Counter(header).items():
        if column not in expected:
            raise ValueError(f"unknown column {column[:200]!r}; expected {', '.join(expected)}")
        if count > 1:
            raise ValueError(f"column {column!r} stands {count} times; expected once")
    for column in expected:
        if column not in header:
            raise ValueError(f"column {column!r} is missing; expected {', '.join(expected)}")


def _row(header: Sequence[str], cells: Sequence[str], line: int) -> dict[str, str]:
    if len(cells) != len(header):
        raise ValueError(f"row {line}: {len(cells)} cells; expected {len(header)} as in the header")
    return dict(zip(header, cells, strict=True))


def _run_numbers(rows: Sequence[dict[str, str]], lines: Sequence[int]) -> tuple[int, ...]:
    seen: dict[int, int] = {}
    for row, line in zip(rows, lines, strict=True):
        text = row[RUN]
        if not (
            text.isascii() and text.isdigit() and len(text) < 20 and 0 < int(text) < _BIGGEST_RUN
        ):
            raise ValueError(
                f"row {line}: run is {text[:200]!r}; expected a whole number "
                f"from 1 to {_BIGGEST_RUN - 1}"
            )
        if int(text) in seen:
            raise ValueError(
                f"row {line}: run {int(text)} stands in row {seen[int(text)]} too; expected once"
            )
        seen[int(text)] = line
    return tuple(seen)
