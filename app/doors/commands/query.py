"""`query`: a question in SQL."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import click

from ..command_line.common import (
    STDOUT,
    db_option,
    format_cell,
    note,
    open_command_store,
    spreadsheet_guard_option,
)

#: Longer cells of the table (lists of points) are cut; CSV and JSON have them whole.
_LONGEST_CELL = 60
#: Rows whose width decides how wide a column of the table is; later rows may be wider.
_MEASURED_ROWS = 1_000
#: Not parsed: loading the registry of units takes as long as a small question.
_TIMEOUT = "60s"


@click.command()
@click.argument("statement", required=False)
@db_option
@click.option(
    "-p",
    "--parameter",
    "parameters",
    nargs=2,
    multiple=True,
    metavar="NAME VALUE",
    help="Give the value of :NAME in the statement. It is bound, never pasted. "
    "The option can be repeated.",
)
@click.option("--csv", "ending", flag_value=".csv", help="Print CSV.")
@click.option("--json", "ending", flag_value=".json", help="Print a list of rows as JSON.")
@click.option(
    "--out",
    metavar="FILE",
    help="Write to FILE.csv, FILE.parquet or FILE.json; - is standard output.",
)
@spreadsheet_guard_option
@click.option("--limit", type=click.IntRange(1), help="List at most this number of rows.")
@click.option(
    "--timeout",
    default=_TIMEOUT,
    show_default=True,
    metavar="SECONDS",
    help="Stop a statement that takes longer than this number of seconds.",
)
@click.option("--tables", is_flag=True, help="List the tables.")
@click.option("--schema", metavar="TABLE", help="List the columns of a table, with units.")
def query(
    statement: str | None,
    db: str,
    parameters: tuple[tuple[str, str], ...],
    ending: str | None,
    out: str | None,
    limit: int | None,
    timeout: str,
    tables: bool,
    schema: str | None,
) -> None:
    """Answer one SELECT statement in SQL from the store; it cannot change anything. Numbers are in
    SI units, with the unit in the name of the column.

    \b
    Example:
        pyroshock query "select name, kind from campaigns"
        pyroshock query "select * from pulses where peak_force_n > :force" -p force 2000 --csv
        pyroshock query --tables
        pyroshock query --schema pulses
    """
    if (statement is not None) + tables + (schema is not None) != 1:
        raise click.UsageError('give one statement ("select ..."), --tables, or --schema TABLE')
    with open_command_store(db) as store:
        from ...operations.store.query import Statement, list_columns, list_tables, run_statement

        if statement is None:
            rows = list_tables() if schema is None else list_columns(schema)
            _write(iter([{name: [row[name] for row in rows] for name in rows[0]}]), ending, out)
            return
        seconds = 60.0 if timeout == _TIMEOUT else _parse_timeout(timeout)
        with run_statement(
            store.engine, Statement(statement, dict(parameters)), seconds
        ) as batches:
            limited = batches if limit is None else _first_rows(batches, limit)
            _write(limited, ending, out)


def _parse_timeout(text: str) -> float:
    from ...common.frames import parse_quantity

    seconds = parse_quantity(text, "s", "--timeout")
    if not seconds > 0:
        raise ValueError(f"--timeout is {text}; expected more than 0s")
    return seconds


def _first_rows(
    batches: Iterator[dict[str, list[Any]]], limit: int
) -> Iterator[dict[str, list[Any]]]:
    remaining = limit
    for batch in batches:
        yield {name: values[:remaining] for name, values in batch.items()}
        remaining -= len(next(iter(batch.values())))
        if remaining <= 0:
            return


def _write(batches: Iterator[dict[str, list[Any]]], ending: str | None, out: str | None) -> None:
    from ...common.table_files import write_batches, write_stream

    if out is not None and out != STDOUT:
        if ending is not None and Path(out).suffix.lower() != ending:
            raise ValueError(
                f"--out {out} does not end in {ending}; "
                f"leave out --{ending[1:]}, or change the name"
            )
        rows = write_batches(Path(out), batches, empty=True)
        note(f"{rows} rows written: {out}")
    elif ending is not None or out is not None:
        write_stream(sys.stdout, ending or ".csv", batches)
    else:
        _print(batches)


def _print(batches: Iterator[dict[str, list[Any]]]) -> None:
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
