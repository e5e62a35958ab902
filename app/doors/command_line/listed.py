"""`--sort`, `--descending`, `--columns`, `--csv` and `--json` of every listing, and the printing of
its rows."""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import wraps
from typing import Any, TypeVar

import click

from ...common.quantities import key_of, velocities_of
from ...operations.operation import Rows
from .common import json_option, note, print_table, spreadsheet_guard_option, write_json
from .options import split_names

Row = dict[str, Any]
Command = TypeVar("Command", bound=Callable[..., Any])


@dataclass(frozen=True)
class Listing:
    """How the rows of a listing are to be printed."""

    json_to: str | None = None
    csv: bool = False
    sort: str | None = None
    descending: bool = False
    columns: tuple[str, ...] = ()

    @property
    def is_chosen(self) -> bool:
        """Whether anything but the usual table is asked for."""
        return self != Listing()

    @property
    def is_by_row(self) -> bool:
        """Whether rows are sorted, chosen by column or written as CSV."""
        return self.csv or self.sort is not None or bool(self.columns)

    def show_answer(self, answer: Rows) -> None:
        """Print the rows of an answer, and what is remarked of them beside the table."""
        self.show(map(dict, answer.rows), answer.empty, answer.shortened)
        for line in answer.notes() if self.json_to is None else ():
            note(line)

    def show(self, rows: Iterable[Row], empty: str, shortened: Callable[[Row], Row] = dict) -> None:
        """Print `rows`, or `empty` where there are none and a person reads it.

        `shortened` makes a row of the table for people; cells of chosen columns that it does not
        have are the row's own. Raises `LookupError` for a column that no row has.
        """
        listed = list(rows)
        with velocities_of(listed):
            listing = (
                self._in_keys(list(dict.fromkeys(name for row in listed for name in row)))
                if listed
                else self
            )
            listing._print(listed, empty, shortened)

    def _print(self, rows: list[Row], empty: str, shortened: Callable[[Row], Row]) -> None:
        wanted = list(self.columns)
        if rows:
            wanted = wanted or list(dict.fromkeys(name for row in rows for name in row))
            rows = self._sorted(rows)
        if self.json_to is not None:
            write_json([_chosen(row, self.columns) for row in rows], self.json_to)
        elif self.csv:
            _print_csv(rows, wanted)
        else:
            print_table((_for_table(row, shortened(row), self.columns) for row in rows), empty)

    def _in_keys(self, keys: list[str]) -> Listing:
        """With keys for what is named by the words of its heading. Raises `LookupError` for what
        names none."""
        from ...common.table_files import check_columns

        columns = tuple(key_of(name, keys) for name in self.columns)
        column = self._sort_column
        sign = "-" if (self.sort or "").startswith("-") else ""
        column = column and key_of(column, keys)
        check_columns([name for name in (column, *columns) if name], keys)
        return replace(self, columns=columns, sort=column and sign + column)

    @property
    def _sort_column(self) -> str | None:
        return self.sort and self.sort.removeprefix("-")

    def _sorted(self, rows: list[Row]) -> list[Row]:
        """Numbers by size and before words; rows without a value last, in whichever direction."""
        column = self._sort_column
        if column is None:
            return rows
        full = [row for row in rows if not _is_empty(row.get(column))]
        empty = [row for row in rows if _is_empty(row.get(column))]
        falling = self.descending != (self.sort or "").startswith("-")
        return sorted(full, key=lambda row: _rank(row[column]), reverse=falling) + empty


def listing_options(command: Command) -> Command:
    """The options of a listing; the command gets one argument `listing`."""

    @json_option
    @spreadsheet_guard_option
    @click.option("--csv", is_flag=True, help="Print CSV on standard output.")
    @click.option(
        "--sort",
        metavar="COLUMN",
        help="Sort by this column, named as in JSON or as in the heading; -COLUMN "
        "begins with the largest.",
    )
    @click.option("--descending", is_flag=True, help="Sort from the largest to the smallest.")
    @click.option(
        "--columns",
        multiple=True,
        callback=split_names,
        metavar="A,B,…",
        help=(
            "Show only these columns, named as in JSON or as in the heading, in this order. Repeat "
            "the option, or give a list: a,b."
        ),
    )
    @wraps(command)
    def with_listing(
        *args: Any,
        json_to: str | None,
        csv: bool,
        sort: str | None,
        descending: bool,
        columns: tuple[str, ...],
        **others: Any,
    ) -> Any:
        if csv and json_to is not None:
            raise click.UsageError("--csv and --json exclude each other")
        if descending and sort is None:
            raise click.UsageError("--descending goes with --sort COLUMN")
        return command(*args, listing=Listing(json_to, csv, sort, descending, columns), **others)

    return with_listing  # type: ignore[return-value]  # click replaces its signature anyway


def _chosen(row: Row, columns: tuple[str, ...]) -> Row:
    return {name: row.get(name) for name in columns} if columns else row


def _for_table(row: Row, short: Row, columns: tuple[str, ...]) -> Row:
    return _chosen(row | short, columns) if columns else short


def _print_csv(rows: list[Row], columns: list[str]) -> None:
    from ...common.table_files import write_stream

    batch = {name: [_csv_cell(row.get(name)) for row in rows] for name in columns}
    write_stream(sys.stdout, ".csv", [batch] if batch else [])


def _csv_cell(value: Any) -> Any:
    if isinstance(value, list | tuple):
        return ", ".join(map(str, value))
    if isinstance(value, dict):
        return json.dumps(value, default=str)
    return value


def _is_empty(value: Any) -> bool:
    return value is None or value == "" or (isinstance(value, float) and math.isnan(value))


def _rank(value: Any) -> tuple[int, float, str]:
    return (0, value, "") if isinstance(value, int | float) else (1, 0.0, str(value))
