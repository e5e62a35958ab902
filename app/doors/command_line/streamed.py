"""`--csv`, `--json` and `--out` of a command whose rows may be more than memory holds: they are
written as they come."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import wraps
from pathlib import Path
from typing import Any, TypeVar

import click

from ...operations.operation import Batches
from .common import STDOUT, format_cell, note, spreadsheet_guard_option

Batch = dict[str, list[Any]]
Command = TypeVar("Command", bound=Callable[..., Any])

#: Longer cells of the table (lists of points) are cut; CSV and JSON have them whole.
_LONGEST_CELL = 60
#: Rows whose width decides how wide a column of the table is; later rows may be wider.
_MEASURED_ROWS = 1_000


@dataclass(frozen=True)
class Stream:
    """How the rows of a command are to be written: in which format (None: a table), and where."""

    ending: str | None = None
    out: str | None = None

    def show_answer(self, answer: Batches) -> None:
        """Write the rows. Raises `ValueError` for a file whose name has another ending."""
        from ...common.table_files import write_batches, write_stream

        if self.out is not None and self.out != STDOUT:
            if self.ending is not None and Path(self.out).suffix.lower() != self.ending:
                raise ValueError(
                    f"--out {self.out} does not end in {self.ending}; "
                    f"leave out --{self.ending[1:]}, or change the name"
                )
            rows = write_batches(Path(self.out), answer.batches, empty=True)
            note(f"{rows} rows written: {self.out}")
        elif self.ending is not None or self.out is not None:
            write_stream(sys.stdout, self.ending or ".csv", answer.batches)
        else:
            _print(answer.batches)


def stream_options(command: Command) -> Command:
    """The options of such a command, which gets one argument `listing`."""

    @click.option("--csv", "ending", flag_value=".csv", help="Print CSV.")
    @click.option("--json", "ending", flag_value=".json", help="Print a list of rows as JSON.")
    @click.option(
        "--out",
        metavar="FILE",
        help="Write to FILE.csv, FILE.parquet or FILE.json; - is standard output.",
    )
    @spreadsheet_guard_option
    @wraps(command)
    def with_stream(*args: Any, ending: str | None, out: str | None, **others: Any) -> Any:
        return command(*args, listing=Stream(ending, out), **others)

    return with_stream  # type: ignore[return-value]  # click replaces its signature anyway


def _print(batches: Iterator[Batch]) -> None:
    """An aligned table, printed as the rows come."""
    widths: list[int] = []
    for batch in batches:
        rows = [tuple(map(_cell, row)) for row in zip(*batch.values(), strict=True)]
        if not widths:
            sample = [tuple(batch), *rows[:_MEASURED_ROWS]]
            widths = [max(map(len, column)) for column in zip(*sample, strict=True)]
            rows = [tuple(batch), *rows]
        lines = ("  ".join(map(str.ljust, row, widths)).rstrip() for row in rows)
        sys.stdout.write("".join(f"{line}\n" for line in lines))


def _cell(value: Any) -> str:
    text = " ".join(format_cell(value).splitlines())
    return text if len(text) <= _LONGEST_CELL else text[: _LONGEST_CELL - 1] + "…"
