"""What a text file's first lines say: delimiter, names, units, statements, where the numbers start.

Text recordings: decoded strictly, and whole to the last line end.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from ...files.delimited_text import decode_instrument_text
from .base import AS_IN_FILE, ReadingOptions, RecordingError, collapse_blanks
from .contents import is_clock_name, is_unit, name_and_unit
from .instrument_header import header_fields, layout_of, recognised
from .instruments import Instrument
from .text_table import BLANKS, DELIMITERS, NO_DELIMITER, Layout, TextTable, read_as

_SAMPLE_LINES = 400


def sniff(path: Path, lines: list[str], options: ReadingOptions = AS_IN_FILE) -> Layout:
    """The layout of a file that starts with `lines`. Raises `RecordingError` where none explains
    it.

    Where the lines above the numbers are those of a known instrument, its entry says what stands
    where. Else a file without a line of names has those of `options`, or `column_1`, `column_2`
    where its rate is given there.
    """
    table, instrument, tables = tabulate(path, lines, options)
    if instrument is not None:
        return with_given_names(layout_of(path, instrument, table, options.decimal), options)
    names, units = _names_and_units(table.titles) if table.titles else ([], [])
    if not names or (table.fits(options.columns) and not _heads_columns(names, options.columns)):
        names, units = _given_names(path, table, tables, options)
    above = table.rows[: table.first]
    statements = header_fields(lines[: table.first], table)
    return Layout(
        table.delimiter,
        options.decimal,
        table.first,
        names,
        units,
        statements,
        above,
        clocks=table.clocks,
    )


def with_given_names(layout: Layout, options: ReadingOptions) -> Layout:
    """A known instrument's layout with the laboratory's names, where there are as many; time stays
    what it is."""
    width = len(layout.names)
    while width and not layout.names[width - 1]:
        width -= 1
    if len(options.columns) != width:
        return layout
    names, units = list(layout.names), list(layout.units)
    for i, label in enumerate(options.columns):
        if names[i] and not is_clock_name(names[i]):
            names[i], unit = name_and_unit(label)
            units[i] = unit or units[i]
    return replace(layout, names=names, units=units)


def tabulate(
    path: Path, lines: list[str], options: ReadingOptions = AS_IN_FILE
) -> tuple[TextTable, Instrument | None, list[TextTable]]:
    """The table that explains the first lines best, its instrument, and all tables that explain
    them."""
    sample = lines[:_SAMPLE_LINES]
    signs = set().union(*sample) | {NO_DELIMITER, BLANKS}
    if options.decimal == "," and '"' not in signs:
        signs -= {","}
    delimiters = [
        sign for sign in DELIMITERS if sign in signs and options.delimiter in (None, sign)
    ]
    tables = [
        t
        for delimiter in delimiters
        if (t := read_as(sample, delimiter, options.decimal)) is not None
    ]
    if not tables:
        raise RecordingError(
            f"{path.name}: no line of numbers found; expected columns "
            f"separated by , ; | tab or blanks"
            + (
                " (and as delimiter and decimal are given)"
                if options.delimiter or options.decimal
                else ""
            )
        )
    instruments = {id(table): recognised(table.rows[: table.first]) for table in tables}
    best = max(
        tables,
        key=lambda t: (
            instruments[id(t)] is not None,
            bool(t.titles) or t.fits(options.columns),
            t.numeric_lines,
            t.columns,
        ),
    )
    return best, instruments[id(best)], tables


def _names_and_units(titles: list[list[str]]) -> tuple[list[str], list[str | None]]:
    """The last line of titles, or the last but one where the last holds units."""
    under = [label.strip("[]() ") for label in titles[-1]]
    if (
        len(titles) > 1
        and any(under)
        and all(label in ("", "-") or is_unit(label) for label in under)
    ):
        pairs = [name_and_unit(label) for label in titles[-2]]
        return [name for name, _ in pairs], [
            u or own for u, (_, own) in zip(under, pairs, strict=True)
        ]
    pairs = [name_and_unit(label) for label in titles[-1]]
    return [name for name, _ in pairs], [unit for _, unit in pairs]


def _heads_columns(names: list[str], given: tuple[str, ...]) -> bool:
    """Whether a line is a heading and no free text of as many words: it names a time, or one of the
    `given` columns."""
    labels = {collapse_blanks(name_and_unit(label)[0]) for label in given}
    return any(name and (collapse_blanks(name) in labels or is_clock_name(name)) for name in names)


def _given_names(
    path: Path, table: TextTable, tables: list[TextTable], options: ReadingOptions
) -> tuple[list[str], list[str | None]]:
    """Names of a table without a line of names: as given, else by number where at least the rate is
    given."""
    width = table.columns - table.empty_at_end
    if options.columns and not table.fits(options.columns):
        raise RecordingError(
            f"{path.name}: has {width} columns of numbers and no line of "
            f"names, and {len(options.columns)} columns are "
            f"named ({', '.join(options.columns)}); expected as many"
        )
    if not options.columns and options.sampling_rate_hz is None:
        raise RecordingError(
            f"{path.name}: {width} columns of numbers from line {table.first + 1} and no line of "
            "names above them; expected a header such as time,force, or columns and "
            'sampling_rate_hz under [recordings] in campaign.toml (call the first column "time" '
            'only where it is time in seconds, and "" where it counts samples)'
        )
    other = next(
        (
            t
            for t in tables
            if t.numeric_lines == table.numeric_lines and t.columns != table.columns
        ),
        None,
    )
    if not options.columns and other is not None:
        raise RecordingError(
            f"{path.name}: can be read as {table.columns} columns or as {other.columns}; give "
            "columns, or decimal, under [recordings] in campaign.toml"
        )
    labels = [*(options.columns or [f"column_{number + 1}" for number in range(width)])]
    pairs = [name_and_unit(label) for label in labels + [""] * (table.columns - len(labels))]
    return [name for name, _ in pairs], [unit for _, unit in pairs]


def read_text(path: Path, *, may_lack_last_end: bool = False) -> str:
    """The file's text, line ends as `\\n`. Raises `RecordingError` unless it is whole UTF-8, UTF-16
    or Windows-1252.

    A last line without line end may be cut inside its last number, which nothing in the file would
    show; it is refused unless `may_lack_last_end`.
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
